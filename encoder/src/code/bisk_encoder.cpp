#include "code/bisk_encoder.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "bisk.h"
#include "code/range_encoder.h"

namespace relief {
namespace {

constexpr int kFinerPlanes = 2;  // below the plane whose step is the one asked for

// A patch as it is coded, from the top.
struct Progress {
  const CodedPatch* coded;
  std::vector<int32_t> target, q;
  std::vector<BiskSet> sets;
  BiskPatch at;
  int planes = 0, passes = 0;
  uint32_t pixels = 0;
  double weight = 1;  // of a squared step, as it counts on the surface
  BiskImage image() { return {coded->image->pyramid, coded->image->mask.data(), q.data(), target.data()}; }
  void restart() {
    std::fill(q.begin(), q.end(), 0);
    pixels = start_patch(coded->image->pyramid, coded->image->mask.data(), sets.data(), at);
    at.plane = int8_t(planes - 1);
  }
};

// A truncation point: bits and squared error after a pass.
struct Point {
  double bits, squared;
};

template <class Visit>
void each_coefficient(const Pyramid& p, const uint8_t* mask, Visit visit) {
  for (int number = 0; number < kBands; number++) {
    const Band& b = band_of(p, number);
    for (uint32_t y = 0; y < b.height; y++)
      for (uint32_t x = 0; x < b.width; x++)
        if (mask[b.at(x, y)]) visit(number, b.at(x, y));
  }
}

float step_of_band(int number, float step) {
  return number == 0 ? step : step * band_step(kLevels - 1 - (number - 1) / 3, (number - 1) % 3);
}

Progress start(const CodedPatch& coded, const StreamPlacement& placement) {
  Progress s;
  s.coded = &coded;
  const WaveletImage& image = *coded.image;
  const float step = step_of(placement, coded.header);
  const double area = double(step) * spacing_of(placement.spacing, coded.header);
  s.weight = std::pow(area / (double(placement.step) * placement.spacing), 2);
  s.target.assign(image.pyramid.size, 0);
  s.q.assign(image.pyramid.size, 0);
  int32_t largest = 0;
  each_coefficient(image.pyramid, image.mask.data(), [&](int number, size_t i) {
    const float v = image.value[i] / step_of_band(number, step);
    const float most = float((1 << kMostPlanes) - 1);
    const int32_t m = int32_t(std::min(std::fabs(v) + 0.5f, most));
    s.target[i] = v < 0 ? -m : m;
    largest = std::max(largest, m);
  });
  s.planes = std::bit_width(uint32_t(largest));
  uint32_t pixels = 0;
  for (size_t i = 0; i < size_t(coded.header.width) * coded.header.height; i++) pixels += coded.mask[i];
  s.sets.resize(pixels);
  s.restart();
  return s;
}

// In units of the stream's squared step; each coefficient in terms of its band's step, see estimate_band.
double squared_error(const Progress& s, float step) {
  const WaveletImage& image = *s.coded->image;
  double sum = 0;
  each_coefficient(image.pyramid, image.mask.data(), [&](int number, size_t i) {
    const double d = double(image.value[i] / step_of_band(number, step)) - s.q[i];
    sum += d * d;
  });
  return sum * s.weight;
}

template <class Coder>
void code_pass(Coder& coder, BiskModels& models, Progress& s) {
  const BiskImage image = s.image();
  BiskCursor cursor;
  start_pass(s.at, cursor);
  while (s.at.refining ? refinement_step(coder, models, image, s.sets.data(), s.at, cursor)
                       : significance_step(coder, models, image, s.sets.data(), s.at, cursor)) {
  }
  end_pass(s.at);
}

// What every truncation point of every patch costs and gains: all are coded plane by plane in step, so that
// the models are about those of the real order.
std::vector<std::vector<Point>> truncation_points(std::vector<Progress>& all,
                                                  const StreamPlacement& placement) {
  std::vector<std::vector<Point>> points(all.size());
  BiskModels models;
  models.init();
  CountingCoder coder;
  int planes = 0;
  for (const Progress& s : all) planes = std::max(planes, s.planes);
  for (int plane = planes - 1; plane >= 0; plane--)
    for (size_t i = 0; i < all.size(); i++) {
      Progress& s = all[i];
      if (s.at.plane != plane) continue;
      const float step = float(double(placement.step) * quarter_power(s.coded->header.step_index));
      if (points[i].empty()) points[i].push_back({0, squared_error(s, step)});
      for (int pass = 0; pass < 2; pass++) {
        const double before = coder.bits();
        code_pass(coder, models, s);
        points[i].push_back({points[i].back().bits + coder.bits() - before, squared_error(s, step)});
      }
    }
  return points;
}

// The gain in squared error for a bit of each pass, along the lower convex hull of the patch's points: it
// only falls.
std::vector<double> slopes(const std::vector<Point>& points) {
  std::vector<size_t> hull;
  auto slope = [&](size_t a, size_t b) {
    return (points[a].squared - points[b].squared) / std::max(points[b].bits - points[a].bits, 1e-9);
  };
  for (size_t i = 0; i < points.size(); i++) {
    while (hull.size() > 1 && slope(hull[hull.size() - 2], hull.back()) <= slope(hull.back(), i))
      hull.pop_back();
    hull.push_back(i);
  }
  std::vector<double> of_pass;
  for (size_t k = 0; k + 1 < hull.size(); k++) of_pass.resize(hull[k + 1], slope(hull[k], hull[k + 1]));
  return of_pass;
}

// Bytes of all passes that gain as much for a bit as the trade asks for.
size_t bytes_at_trade(const std::vector<std::vector<Point>>& points, double trade) {
  double bits = 0;
  for (const std::vector<Point>& p : points) {
    const std::vector<double> of_pass = slopes(p);
    const auto passes = std::count_if(of_pass.begin(), of_pass.end(), [&](double s) { return s >= trade; });
    if (passes > 0) bits += p[size_t(passes)].bits;
  }
  return size_t(bits / 8);
}

// The layer of each pass of each patch. By rate and distortion: layers of falling slopes.
std::vector<std::vector<int>> layers_by_slope(const std::vector<std::vector<Point>>& points, double trade) {
  constexpr double kLayersAnOctave = 2;
  constexpr int kBelow = 8;  // layers of lower slopes than the trade
  std::vector<std::vector<int>> layer(points.size());
  for (size_t i = 0; i < points.size(); i++)
    for (double s : slopes(points[i])) {
      const double above = s > 0 ? std::floor(std::log2(s / trade) * kLayersAnOctave) : -kMostLayers;
      layer[i].push_back(std::clamp(kMostLayers - 1 - kBelow - int(above), 0, kMostLayers - 1));
    }
  return layer;
}

// Evenly (equation 5): as many bits a pixel for every patch, more from layer to layer.
std::vector<std::vector<int>> layers_by_rate(const std::vector<std::vector<Point>>& points,
                                             const std::vector<Progress>& all) {
  constexpr double kLayersAnOctave = 4;
  double most = 0;
  for (size_t i = 0; i < points.size(); i++)
    if (!points[i].empty()) most = std::max(most, points[i].back().bits / all[i].pixels);
  std::vector<std::vector<int>> layer(points.size());
  for (size_t i = 0; i < points.size(); i++)
    for (size_t k = 1; k < points[i].size(); k++) {
      const double below = -std::log2(points[i][k].bits / all[i].pixels / most) * kLayersAnOctave;
      const int l =
          std::clamp(kMostLayers - 1 - int(std::min(below, double(kMostLayers))), 0, kMostLayers - 1);
      layer[i].push_back(std::max(l, layer[i].empty() ? 0 : layer[i].back()));
    }
  return layer;
}

}  // namespace

float finest_bisk_step(float step) { return step / (1 << kFinerPlanes); }

EmbeddedCode code_bisk(const std::vector<CodedPatch>& patches, const StreamPlacement& placement) {
  std::vector<Progress> all;
  for (const CodedPatch& p : patches) all.push_back(start(p, placement));
  const auto points = truncation_points(all, placement);
  // in terms of the finest step
  const double trade = std::max(double(placement.trade), 1e-9) * (1 << 2 * kFinerPlanes);
  const auto layer = placement.even ? layers_by_rate(points, all) : layers_by_slope(points, trade);

  EmbeddedCode code;
  RangeEncoder coder;
  BiskModels models;
  models.init();
  for (Progress& s : all) {
    s.restart();
    code_planes(coder, models, s.planes);
  }
  for (int l = 0; l < kMostLayers; l++) {
    for (size_t i = 0; i < all.size(); i++) {
      Progress& s = all[i];
      int made = 0;
      while (s.at.plane >= 0) {
        const int more = layer[i][size_t(s.passes)] <= l;
        code_more(coder, models, s.at, made, more);
        if (!more) break;
        code_pass(coder, models, s);
        s.passes++, made++;
      }
      s.at.before = uint8_t(made);
    }
  }
  constexpr size_t kAhead = 5;  // bytes that the decoder reads ahead of the coder's size
  const size_t size = coder.size();
  code.bytes = coder.finish();
  code.bytes.resize(size + kAhead + kPlanesBytes);  // enough left for the last steps
  code.at_trade = std::min(bytes_at_trade(points, trade) + kAhead + kStepBytes, code.bytes.size());
  return code;
}

}  // namespace relief
