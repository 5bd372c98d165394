// The decoder's door to JavaScript: the C API itself, and the memory to call it with.
//
// The module imports nothing. Its memory is handed out by moving one pointer up from the end of the static
// data and is taken back all at once, so a decode that fails half-way leaves nothing behind.
#include <stddef.h>
#include <stdint.h>

#include "relief/relief.h"

// relief.mjs reads and writes these structures by offset.
static_assert(sizeof(void*) == 4, "for wasm32");
static_assert(offsetof(relief_limits, max_memory) == 16);
static_assert(sizeof(relief_limits) == 24);
static_assert(offsetof(relief_options, level) == 8);
static_assert(sizeof(relief_options) == 28);
static_assert(offsetof(relief_info, triangle_capacity) == 24);
static_assert(offsetof(relief_info, workspace_bytes) == 32);
static_assert(offsetof(relief_info, origin) == 40);
static_assert(offsetof(relief_info, scale) == 52);
static_assert(offsetof(relief_info, masks_end) == 56);
static_assert(offsetof(relief_info, has_colors) == 60);
static_assert(sizeof(relief_info) == 64);
static_assert(offsetof(relief_mesh, colors) == 8);
static_assert(offsetof(relief_mesh, vertex_capacity) == 16);
static_assert(offsetof(relief_mesh, vertex_count) == 24);
static_assert(offsetof(relief_mesh, min) == 32);
static_assert(sizeof(relief_mesh) == 72);

extern "C" {

extern unsigned char __heap_base;  // set by the linker: the first byte after static data and stack

static uint32_t g_used = 0;  // bytes handed out since the last reset

// Returns `size` bytes aligned to 16, or 0 if the memory cannot grow that far.
uint32_t relief_wasm_allocate(uint32_t size) {
  const uint64_t page = 65536;
  const uint64_t base = ((uint64_t)(uintptr_t)&__heap_base + 15) & ~(uint64_t)15;
  const uint64_t begin = base + g_used;
  const uint64_t end = (begin + size + 15) & ~(uint64_t)15;
  const uint64_t pages = (end + page - 1) / page;
  if (pages > 65535) return 0;  // keeps every address below 2^32
  const size_t have = __builtin_wasm_memory_size(0);
  if (pages > have && __builtin_wasm_memory_grow(0, (size_t)(pages - have)) == (size_t)-1) return 0;
  g_used = (uint32_t)(end - base);
  return (uint32_t)begin;
}

// Takes back everything that was handed out.
void relief_wasm_reset() { g_used = 0; }

}  // extern "C"
