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
  RELIEF_ERROR_ARGUMENT = 1,  /* a pointer is null, or the workspace is not aligned to 16 bytes */
  RELIEF_ERROR_TRUNCATED = 2, /* the bytes end before the header, the patch table or the masks are complete */
  RELIEF_ERROR_MAGIC = 3,     /* the bytes do not begin with "RLF" */
  RELIEF_ERROR_VERSION = 4,   /* a stream version that this decoder does not know */
  RELIEF_ERROR_CORRUPT = 5,   /* a field is out of range, or two fields contradict each other */
  RELIEF_ERROR_LIMIT = 6,     /* the stream asks for more than the caller's limits allow */
  RELIEF_ERROR_WORKSPACE = 7, /* the workspace is smaller than relief_info.workspace_bytes */
  RELIEF_ERROR_OUTPUT = 8     /* the output is smaller than the mesh */
} relief_status;

/* A sentence in English for a status; never null, valid for ever. */
RELIEF_API const char* relief_status_text(relief_status status);

/* Upper bounds on what a stream may ask for, checked before anything is sized by the stream.
 * A null pointer in place of the limits means relief_default_limits. */
typedef struct relief_limits {
  uint32_t max_patches;  /* patches; default 1 << 20 */
  uint32_t max_pixels;   /* pixels of all patch rectangles together; default 1 << 28 */
  uint32_t max_vertices; /* vertices of the mesh; default 1 << 27 */
} relief_limits;
RELIEF_API extern const relief_limits relief_default_limits;

/* What a stream holds. Counts are vertices and triangles of the mesh that the whole stream decodes to. */
typedef struct relief_info {
  uint32_t version;
  uint32_t patch_count;
  uint32_t pixel_count;       /* pixels of all patch rectangles, inside and outside of the masks */
  uint32_t vertex_count;      /* exact, as promised by the encoder; the decoder of a whole stream returns this */
  uint32_t triangle_count;    /* exact, likewise */
  uint32_t vertex_capacity;   /* no decode of this stream or of a prefix of it writes more vertices */
  uint32_t triangle_capacity; /* ... or more triangles */
  uint64_t workspace_bytes;   /* memory that relief_decode needs */
  float origin[3];            /* position = origin + scale * (integer lattice coordinates) */
  float scale;
  uint32_t masks_end;         /* bytes of header, patch table and masks: the shortest prefix that decodes */
} relief_info;

/* Reads the header of a stream (or of a prefix of it that holds at least the header).
 *   data, size   the bytes; need not be aligned. More bytes than the stream has are CORRUPT
 *   limits       upper bounds, or null for relief_default_limits
 *   info         receives the result; untouched unless RELIEF_OK
 * Errors: ARGUMENT, TRUNCATED, MAGIC, VERSION, CORRUPT, LIMIT. Time: proportional to the number of patches. */
RELIEF_API relief_status relief_inspect(const void* data, size_t size, const relief_limits* limits,
                                        relief_info* info);

/* Where relief_decode writes. The caller owns all arrays. */
typedef struct relief_mesh {
  float* positions;           /* 3 floats a vertex, in the units of the model */
  float* normals;             /* 3 floats a vertex, unit length, or null if not wanted */
  uint32_t* indices;          /* 3 indices a triangle, counter-clockwise seen from outside */
  uint32_t vertex_capacity;   /* vertices that positions (and normals) have room for */
  uint32_t triangle_capacity; /* triangles that indices has room for */
  uint32_t vertex_count;      /* written: vertices of the mesh */
  uint32_t triangle_count;    /* written: triangles of the mesh */
} relief_mesh;

/* Decodes a stream to a triangle mesh with closed gaps.
 *   data, size       the stream, or any prefix of it of at least relief_info.masks_end bytes: a prefix decodes to
 *                    a coarser surface over the same masks
 *   limits           as for relief_inspect
 *   mesh             in: arrays and capacities; out: counts. Capacities of relief_info.vertex_capacity and
 *                    triangle_capacity always suffice; vertex_count and triangle_count do for a whole stream.
 *   workspace        relief_info.workspace_bytes bytes, aligned to 16; contents are scratch
 * Errors: those of relief_inspect, WORKSPACE, OUTPUT. After an error the arrays hold unspecified values.
 * The same bytes give the same mesh, bit for bit, on every machine. */
RELIEF_API relief_status relief_decode(const void* data, size_t size, const relief_limits* limits,
                                       relief_mesh* mesh, void* workspace, size_t workspace_size);

/* As relief_decode, and then moves every vertex on the border of a patch a third of the way to the mean of its
 * neighbours (the boundary smoothing of the paper, 5.3). At coarse errors the seams between patches are seen less; at
 * fine ones detail along them is lost. The error measure rises, by 9% on Dragon at E = 4; counts and indices are the
 * same.
 * Arguments, errors and promises are those of relief_decode. */
RELIEF_API relief_status relief_decode_smoothed(const void* data, size_t size, const relief_limits* limits,
                                                relief_mesh* mesh, void* workspace, size_t workspace_size);

#ifdef __cplusplus
}
#endif
#endif
