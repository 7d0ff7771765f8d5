#include "services/landmark_extractor/ground_sample.hpp"

#include <algorithm>

namespace understory {
namespace {

/// So many points tell the ground well enough.
constexpr std::size_t kEnough = 32768;
constexpr std::size_t kLanes = 8;

}  // namespace

void GroundSample::take(const PointSweep& sweep, const Levelling& levelling) {
  grid_ = GroundGrid::around(levelling.sensor_m.x(), levelling.sensor_m.y(), levelling.max_range_m);
  x_.clear();
  y_.clear();
  z_.clear();
  cell_.clear();
  // A column at least, so that no beam is always left out.
  const std::size_t column = std::max<std::size_t>(sweep.rings, 1);
  const std::size_t stride = std::max<std::size_t>(1, sweep.points.size() / kEnough);
  const std::size_t length = stride == 1 ? PointBlock::kSize : column;
  for (std::size_t begin = 0; begin < sweep.points.size(); begin += stride * length) {
    const std::size_t end = std::min(begin + length, sweep.points.size());
    for (std::size_t first = begin; first < end; first += PointBlock::kSize) {
      const std::size_t count = std::min(PointBlock::kSize, end - first);
      locate_block({sweep.points.data() + first, count}, levelling, grid_, block_);
      const auto add = [&](const auto& from, auto& to) {
        to.insert(to.end(), from.begin(), from.begin() + static_cast<std::ptrdiff_t>(count));
      };
      add(block_.x, x_);
      add(block_.y, y_);
      add(block_.z, z_);
      add(block_.cell, cell_);
    }
  }
  const std::size_t size = (x_.size() + kLanes - 1) / kLanes * kLanes;
  x_.resize(size, 0.0F);
  y_.resize(size, 0.0F);
  z_.resize(size, 0.0F);
  cell_.resize(size, grid_.nowhere());
}

}  // namespace understory
