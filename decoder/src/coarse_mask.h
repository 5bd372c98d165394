// Masks of coarser levels, which the encoder has not cleaned.
#pragma once
#include <stddef.h>
#include <stdint.h>

namespace relief {

// Takes pixels out of a mask until every one is in a triangle and the triangles around it are one fan, so
// that meshing cannot fail (4.2). mask: pixel (0, 0), zeros around; queue: w * h elements of scratch.
void tidy_mask(uint8_t* mask, uint32_t w, uint32_t h, ptrdiff_t stride, uint32_t* queue);

}  // namespace relief
