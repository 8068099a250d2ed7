// How a shader reads the scene's records: RECORDS(Block, Record, records, record_at) declares a block of them and the
// function that reads one.
// Reads: the storage block `Block` or, with RECORDS_IN_TEXTURES, a texture of the same name and bytes, four words a
//   texel, row by row (app/gpu/records.py says when, and why).
#include "shared/structs.glsl"

#ifdef RECORDS_IN_TEXTURES
#define RECORDS(Block, Record, records, record_at) \
    uniform usampler2D Block; \
    Record record_at(uint i) { Record record; read_record(Block, i, record); return record; }
#else
#define RECORDS(Block, Record, records, record_at) \
    layout(std430) readonly buffer Block { Record records[]; }; \
    Record record_at(uint i) { return records[i]; }
#endif
