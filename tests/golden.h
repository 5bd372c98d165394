// The golden streams: see golden/README.md.
#pragma once
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace relief {

struct Golden {
  std::string name, hash;  // hash_of the decoded mesh
  bool closed = false;     // the surface has no border
  size_t components = 0;
  std::vector<uint8_t> stream;
};

inline std::vector<uint8_t> read_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(path + " cannot be read");
  return {std::istreambuf_iterator<char>(file), {}};
}

inline std::vector<Golden> read_golden(const std::string& folder) {
  std::ifstream list(folder + "/golden.txt");
  if (!list) throw std::runtime_error(folder + "/golden.txt cannot be read");
  std::vector<Golden> all;
  for (std::string line; std::getline(list, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream fields(line);
    Golden g;
    if (!(fields >> g.name >> g.hash >> g.closed >> g.components))
      throw std::runtime_error("golden.txt: " + line);
    g.stream = read_bytes(folder + "/" + g.name + ".relief");
    all.push_back(std::move(g));
  }
  return all;
}

}  // namespace relief
