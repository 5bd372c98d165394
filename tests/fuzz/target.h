// What a fuzz target is made of. Its file defines the two functions; the rest of a program is libFuzzer's
// (clang) or replay.cpp.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace relief {

// Good inputs, for mutations to start from.
std::vector<std::string> seeds();

// Runs on any bytes and ends the program if a promise is broken; memory errors are the sanitizers' part. True
// if they were accepted as a good file.
bool accepts(const uint8_t* data, size_t size);

}  // namespace relief
