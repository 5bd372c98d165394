// First guesses of what the models of coefficients learn. Trained on scans; part of the format. Shared with
// the encoder.
#pragma once
#include <stdint.h>

namespace relief {

constexpr int kActivities = 20;  // classes of the expected magnitude

// What guesses are worth: of bits by activity, by the nearest magnitudes, of signs and of numbers.
constexpr uint32_t kFirstCount = 12, kFirstNearCount = 4, kFirstSignCount = 30, kFirstGolombCount = 15;

// In 1/65536, that a coefficient of a quantiser and an activity is not zero; and by how much that is moved in
// the logistic domain, in 1/32, by quantiser, band type, scale and mask edge.
constexpr uint16_t kFirstNonzero[2][kActivities] = {
    {374,   219,   216,   422,   1174,  1760,  3536,  4445,  6817,  10068,
     17078, 25334, 30230, 37621, 42608, 49455, 51888, 57142, 58296, 62638},
    {32,    32,    53,    63,    177,   533,   1294,  5812,  13533, 26088,
     35151, 43362, 54891, 57821, 62447, 61006, 62677, 62507, 63127, 64553}};
constexpr int8_t kNonzeroMove[2][3][3][2] = {
    {{{-15, -11}, {2, 17}, {13, 39}}, {{-13, -5}, {2, 15}, {10, 38}}, {{-30, -37}, {-12, -7}, {6, 12}}},
    {{{2, -25}, {13, -2}, {11, 8}}, {{6, -12}, {16, 1}, {9, 10}}, {{-5, -45}, {3, -30}, {5, -15}}}};

// In 1/256, that a magnitude is greater than 1, than 2, than any k beyond; moved likewise, by scale.
constexpr uint8_t kFirstGreater[kActivities][3] = {
    {161, 192, 235}, {27, 25, 107},   {48, 55, 106},   {29, 96, 119},   {35, 70, 134},
    {27, 96, 166},   {21, 77, 137},   {23, 69, 155},   {19, 59, 147},   {25, 52, 128},
    {31, 52, 120},   {48, 58, 106},   {65, 70, 113},   {87, 91, 116},   {106, 107, 129},
    {130, 122, 144}, {153, 139, 157}, {174, 161, 169}, {194, 179, 185}, {222, 222, 224}};
constexpr int8_t kGreaterMove[3] = {0, 16, 35};

// In 1/256, that a coefficient is negative, by band type and context.
constexpr uint8_t kFirstSign[3][9] = {{89, 171, 213, 60, 135, 189, 37, 80, 144},
                                      {93, 63, 42, 164, 123, 88, 209, 189, 154},
                                      {62, 97, 143, 81, 131, 180, 115, 155, 194}};

// In 1/256, that the prefix of a number goes on: of magnitudes' tails, and of the coarsest LL.
constexpr uint8_t kFirstTail[2][14] = {{220, 203, 180, 148, 125, 105, 100, 80, 60, 40, 40, 40, 40, 40},
                                       {243, 237, 222, 200, 174, 150, 120, 94, 71, 50, 40, 40, 40, 40}};
constexpr uint8_t kFirstLow[14] = {254, 254, 254, 250, 243, 240, 228, 210, 180, 150, 110, 70, 50, 40};

}  // namespace relief
