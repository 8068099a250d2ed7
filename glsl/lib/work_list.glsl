// Work groups over a list of items, folded into rows: OpenGL guarantees no more than 65 535 groups along one dimension,
// which 64 items each exhaust at four million. Twin: tests/gpu/test_work_list.py.

const uint GROUP_ITEMS = 64u;
const uint ROW_GROUPS = 32768u;

// So many groups along x and y.
uvec2 folded_groups(uint groups) {
    return uvec2(min(groups, ROW_GROUPS), (groups + ROW_GROUPS - 1u) / ROW_GROUPS);
}

// The number of a group, in the order of its rows. Those past the list's end have none.
uint group_of(uvec2 group) {
    return group.y * ROW_GROUPS + group.x;
}

// Groups along x and y that cover `items`.
uvec2 groups_over(uint items) {
    return folded_groups((items + GROUP_ITEMS - 1u) / GROUP_ITEMS);
}

// The item of an invocation: `lane` of 0..63 in work group `group`. Those past the list's end have none.
uint item_of(uvec2 group, uint lane) {
    return group_of(group) * GROUP_ITEMS + lane;
}

// Place of an item in a list of a kind, among lists of room for `most` items each.
uint list_place(uint class_, uint slot, uint most) {
    return class_ * most + slot;
}
