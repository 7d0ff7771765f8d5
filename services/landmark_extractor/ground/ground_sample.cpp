#include "services/landmark_extractor/ground/ground_sample.hpp"

#include <algorithm>

#include "services/landmark_extractor/lanes.hpp"

namespace understory::landmark_extractor::ground {
namespace {

/// Number of points that is sufficient for the ground.
constexpr std::size_t kEnough = 20000;

}  // namespace

void GroundSample::take(const model::PointSweep& sweep, const points::Levelling& levelling) {
  grid_ = points::GroundGrid::around(levelling.sensor_m.x(), levelling.sensor_m.y(),
                                     levelling.max_range_m);

  // At least one column, so that no beam is always omitted.
  const std::size_t column = std::max<std::size_t>(sweep.rings, 1);
  const std::size_t stride = std::max<std::size_t>(1, sweep.points.size() / kEnough);
  const std::size_t length = stride == 1 ? points::PointBlock::kSize : column;
  reserve(std::min(sweep.points.size(), sweep.points.size() / stride + 2 * length) + kLanes);

  std::size_t size = 0;
  for (std::size_t begin = 0; begin < sweep.points.size(); begin += stride * length) {
    const std::size_t end = std::min(begin + length, sweep.points.size());
    for (std::size_t first = begin; first < end; first += points::PointBlock::kSize) {
      const std::size_t count = std::min(points::PointBlock::kSize, end - first);
      locate_block({sweep.points.data() + first, count}, levelling, grid_, block_);
      const auto add = [&](const auto& from, auto& to) {
        std::copy_n(from.begin(), count, to.begin() + static_cast<std::ptrdiff_t>(size));
      };
      add(block_.x, x_);
      add(block_.y, y_);
      add(block_.z, z_);
      add(block_.cell, cell_);
      size += count;
    }
  }
  pad(size);
}

void GroundSample::reserve(std::size_t size) {
  if (x_.size() >= size) return;
  x_.resize(size + size / 2);
  y_.resize(x_.size());
  z_.resize(x_.size());
  cell_.resize(x_.size());
}

/// Pads to a whole number of registers.
void GroundSample::pad(std::size_t size) {
  size_ = (size + kLanes - 1) / kLanes * kLanes;
  for (std::size_t i = size; i < size_; ++i) {
    x_[i] = y_[i] = z_[i] = 0.0F;
    cell_[i] = grid_.nowhere();
  }
}

}  // namespace understory::landmark_extractor::ground
