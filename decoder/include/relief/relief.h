/* Relief: decoder for compressed dense surfaces (glTF extension RELIEF_patch_compression).
 *
 * This header is the whole contract. It compiles alone as C99 and as C++. The decoder uses no library, allocates
 * nothing, keeps no state between calls and may be called from any number of threads at once, as long as no two
 * calls share memory they write to.
 *
 * Every function may be given hostile bytes. It then returns an error code or a (meaningless but well formed)
 * mesh: indices are always below vertex_count, positions are always finite, and the triangles are an oriented manifold
 * (every edge is in one or two triangles, which run along it in opposite ways; around every vertex there is one fan).
 *
 * Method: Ochotta and Saupe, "Image-Based Surface Compression", Computer Graphics Forum 2008. The comments in
 * src/ name the section of that paper which each file implements. Format: docs/RELIEF_patch_compression.
 */
#ifndef RELIEF_H
#define RELIEF_H

#include <stddef.h>
#include <stdint.h>

/* What a shared library exports; nothing else is visible in it. */
#ifndef RELIEF_API
#ifdef __GNUC__
#define RELIEF_API __attribute__((visibility("default")))
#else
#define RELIEF_API
#endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* The stream version that this decoder reads and the encoder writes. Version 0 may still change. */
#define RELIEF_STREAM_VERSION 0

typedef enum relief_status {
  RELIEF_OK = 0,
  RELIEF_ERROR_ARGUMENT = 1,  /* a pointer is null, an option out of range, the workspace not aligned to 16 bytes */
  RELIEF_ERROR_TRUNCATED = 2, /* the bytes end before the header or the patch table is complete, or within
                                 the masks and are too few for the memory that is needed (max_memory) */
  RELIEF_ERROR_MAGIC = 3,     /* the bytes do not begin with "RLF" */
  RELIEF_ERROR_VERSION = 4,   /* a stream version that this decoder does not know */
  RELIEF_ERROR_CORRUPT = 5,   /* a field is out of range, or two fields contradict each other */
  RELIEF_ERROR_LIMIT = 6,     /* the stream asks for more than the caller's limits allow */
  RELIEF_ERROR_WORKSPACE = 7, /* the workspace is smaller than relief_info.workspace_bytes */
  RELIEF_ERROR_OUTPUT = 8     /* the output is smaller than the mesh */
} relief_status;

/* A sentence in English for a status, "unknown status" for any other number; never null, valid for ever. */
RELIEF_API const char* relief_status_text(int status);

/* Upper bounds on what a stream may ask for, checked before anything is sized by the stream. */
typedef struct relief_limits {
  uint32_t max_patches;  /* patches; default 1 << 20 */
  uint32_t max_pixels;   /* pixels of all patch rectangles together; default 1 << 28 */
  uint32_t max_vertices; /* vertices of the mesh; default 1 << 27 */
  /* Memory, as relief_inspect puts it from above by a formula (bitstream.md, section 14): workspace and output
   * together never take more bytes than that. 0, the default: 1 GiB and 64 KiB for each byte that is given. Scans
   * take some KB for each byte of their streams; a damaged or hostile stream may ask for far more. */
  uint64_t max_memory;
} relief_limits;
RELIEF_API extern const relief_limits relief_default_limits;

/* The coarsest level: see relief_options.level. */
#define RELIEF_MAX_LEVEL 4

/* Flags of relief_options. */
enum {
  /* Move every vertex on the border of a patch a third of the way to the mean of its neighbours (the boundary
   * smoothing of the paper, 5.3). At coarse errors the seams between patches are seen less; at fine ones detail
   * along them is lost. The error measure rises, by 9% on Dragon at E = 4; counts and indices are the same. */
  RELIEF_SMOOTH = 1,
  /* Points instead of triangles: the vertices of the patches as they are, gaps between patches left open, normals
   * from the surface of each patch alone. relief_mesh.indices is not used and may be null. Not with RELIEF_SMOOTH. */
  RELIEF_POINTS = 2,
  /* The types of KHR_mesh_quantization in place of floats: positions are 4 int16 a vertex, three coordinates, which
   * relief_mesh tells how to scale, and a 0; normals are 4 int8, three times 127 and a 0. */
  RELIEF_QUANTISED = 4,
  /* Indices are uint16. A mesh of more than 65535 vertices is an error (OUTPUT). */
  RELIEF_INDICES_16 = 8
};

/* What to decode and how to write it. All zero means: the whole mesh, floats, 32-bit indices, tightly packed. A null
 * pointer in place of the options means the same. */
typedef struct relief_options {
  const relief_limits* limits; /* null: relief_default_limits */
  /* The patches to decode: relief_info.patch_count bytes, not 0 for those that are wanted; null: all. The vertices of
   * a patch are the same as in the whole mesh, in the same order. If any patch is left out, gaps are closed as in a
   * prefix: where no more than 12 border vertices are around one. All masks and coefficients are read in any case,
   * for patches share their models. */
  const uint8_t* patches;
  /* The grid is coarser by 2^level each way, 0 .. RELIEF_MAX_LEVEL: about 4^level times fewer vertices, and less
   * time. A mesh of a level above 0 is an oriented manifold like any other, and without a border if the stream says
   * that the surface has none (as the encoder does for closed input). It may lose what is thinner than two pixels of
   * its grid, down to nothing at all, and its components, handles and holes may differ from those of level 0. */
  uint32_t level;
  uint32_t flags; /* RELIEF_SMOOTH | ... */
  /* Bytes from one vertex to the next, multiples of 4, at least a vertex' size; 0: that size (12 bytes; of
   * RELIEF_QUANTISED 8 for positions, 4 for normals; 4 for colours). Bytes in between are left alone: arrays can be
   * interleaved. */
  uint32_t position_stride, normal_stride, color_stride;
} relief_options;

/* What a stream holds. */
typedef struct relief_info {
  uint32_t version;
  uint32_t patch_count;
  uint32_t pixel_count;       /* pixels of all patch rectangles, inside and outside of the masks */
  uint32_t vertex_count;      /* of the whole mesh at level 0: exact, as promised by the encoder */
  uint32_t triangle_count;    /* likewise */
  uint32_t vertex_capacity;   /* no decode of this stream or of a prefix of it, with these options, writes more ... */
  uint32_t triangle_capacity; /* ... vertices or triangles */
  uint64_t workspace_bytes;   /* memory that relief_decode needs, with these options */
  float origin[3];            /* position = origin + scale * (integer lattice coordinates). Coordinates lie within */
  float scale;                /* +-2^20: the only bounds of the mesh that can be had without decoding */
  uint32_t masks_end;         /* bytes of header, patch table and masks: from here on a prefix has all patches */
  uint32_t has_colors;        /* 1: vertices have colours; else 0 */
} relief_info;

/* Reads the header and the patch table of a stream (or of a prefix of it that holds at least these).
 *   data, size   the bytes; need not be aligned. More bytes than the stream has are CORRUPT
 *   options      those that relief_decode will be called with, or null. Not looked at: options->patches
 *   info         receives the result; untouched unless RELIEF_OK
 * Errors: ARGUMENT (also: an option is out of range), TRUNCATED, MAGIC, VERSION, CORRUPT, LIMIT.
 * Time: proportional to the number of patches. */
RELIEF_API relief_status relief_inspect(const void* data, size_t size, const relief_options* options,
                                        relief_info* info);

/* Where relief_decode writes. The caller owns all arrays; they are aligned as their elements are, and do not overlap
 * one another but by strides, nor the workspace or the stream. A decode may write anywhere within the capacities, also
 * behind the counts, and reads back what it wrote: decode to memory that is fast to read, and copy to what is not. */
typedef struct relief_mesh {
  void* positions;            /* 3 floats a vertex, in the units of the model (RELIEF_QUANTISED: 4 int16) */
  void* normals;              /* 3 floats a vertex, unit length (RELIEF_QUANTISED: 4 int8); null if not wanted */
  void* colors;               /* 4 uint8 a vertex: red, green, blue as sRGB, and 255; null if not wanted. Colours come
                                 last in a stream: in a prefix without any of theirs all are a grey of 128. Untouched
                                 if relief_info.has_colors is 0 */
  void* indices;              /* 3 uint32 a triangle (RELIEF_INDICES_16: uint16), counter-clockwise from outside */
  uint32_t vertex_capacity;   /* vertices that positions (and normals) have room for */
  uint32_t triangle_capacity; /* triangles that indices has room for */
  uint32_t vertex_count;      /* written: vertices of the mesh */
  uint32_t triangle_count;    /* written: triangles of the mesh */
  float min[3], max[3];       /* written: bounds of the positions as floats, exact; zeros if there are no vertices */
  float offset[3], scale;     /* written: position = offset + scale * max(int16 / 32767, -1) with RELIEF_QUANTISED */
} relief_mesh;

/* Decodes a stream to a triangle mesh with closed gaps.
 *   data, size       the stream, or any prefix of it that holds the patch table: from relief_info.masks_end bytes on
 *                    a prefix decodes to a coarser surface over the same masks; a shorter one to the patches whose
 *                    masks it has, flat, as if the others were left out (see relief_options.patches)
 *   options          what to decode and how to write it; null: everything, as floats
 *   mesh             in: arrays and capacities; out: counts and bounds. Capacities of relief_info.vertex_capacity and
 *                    triangle_capacity always suffice; vertex_count and triangle_count do for a whole stream at
 *                    level 0.
 *   workspace        relief_info.workspace_bytes bytes, aligned to 16; contents are scratch
 * Errors: those of relief_inspect but for max_memory, which is the caller's concern here; WORKSPACE, OUTPUT. After an
 * error the arrays hold unspecified values and the counts are what they were.
 * The same bytes and options give the same mesh, bit for bit, on every machine. */
RELIEF_API relief_status relief_decode(const void* data, size_t size, const relief_options* options,
                                       relief_mesh* mesh, void* workspace, size_t workspace_size);

/* As relief_decode, for a stream that is still arriving: call it again whenever there are more bytes. What was done
 * with the earlier ones is not done again, but for the bytes of a row of coefficients or about a thousand, and for the
 * mesh, which is made anew at each call. The mesh is that of relief_decode with the same bytes, bit for bit.
 *   data, size       all bytes so far, from the beginning of the stream; the earlier ones are the same as before, but may
 *                    lie elsewhere
 *   options          the same at every call, but for limits, patches and strides
 *   mesh             as for relief_decode; null: take the bytes in, without a mesh. Its arrays may be others each time
 *   workspace        as for relief_decode; it is left alone between the calls (or moved, to where it is aligned as well)
 *   taken            in: 0, to begin a stream, or what the call before wrote; out: the bytes taken in. Untouched after
 *                    an error of the stream, and as long as there are less than relief_info.masks_end bytes, which
 *                    are gone through again each time; written before an error of the mesh (OUTPUT, CORRUPT), so
 *                    that one can go on from there, too
 * Errors: those of relief_decode. ARGUMENT also if taken is null or above size, or options or bytes up to
 * relief_info.masks_end are not those of the call before. */
RELIEF_API relief_status relief_decode_more(const void* data, size_t size, const relief_options* options,
                                            relief_mesh* mesh, void* workspace, size_t workspace_size,
                                            size_t* taken);

#ifdef __cplusplus
}
#endif
#endif
