#include "common/model/point_sweep.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace understory::model {

namespace {

/// Largest number of points for which memory is reserved by the header alone, which may be wrong.
constexpr std::size_t kLargestReserve = std::size_t{1} << 20;

PointSweep without_points(const PointSweep& sweep) {
  return {sweep.utime,       sweep.sequence,          sweep.revolution,  sweep.part,
          sweep.parts,       sweep.has_times,         sweep.is_deskewed, sweep.rings,
          sweep.max_range_m, sweep.sensor_position_m, sweep.attitude,    {}};
}

}  // namespace

std::vector<PointSweep> split_sweep(const PointSweep& sweep, std::size_t max_points) {
  if (max_points == 0) throw std::invalid_argument("split_sweep: max_points must be positive");
  const std::vector<SweepPoint>& points = sweep.points;
  const std::size_t count = std::max<std::size_t>(1, (points.size() + max_points - 1) / max_points);
  if (count > 65535) throw std::invalid_argument("split_sweep: too many parts");

  std::vector<PointSweep> parts(count, without_points(sweep));
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t begin = i * max_points;
    const std::size_t end = std::min(points.size(), begin + max_points);
    parts[i].part = static_cast<std::uint16_t>(i);
    parts[i].parts = static_cast<std::uint16_t>(count);
    parts[i].points.assign(points.begin() + static_cast<std::ptrdiff_t>(begin),
                           points.begin() + static_cast<std::ptrdiff_t>(end));
  }
  return parts;
}

std::optional<PointSweep> SweepAssembler::add(PointSweep part) {
  const bool continues = pending_ && pending_->revolution == part.revolution &&
                         pending_->utime == part.utime && pending_->parts == part.parts &&
                         part.part == next_part_;

  // The first part of a revolution, or the next one of the pending revolution.
  if (!continues) {
    if (pending_) count_incomplete(pending_->revolution);
    pending_.reset();
    if (part.part != 0) {
      if (lost_revolution_ != part.revolution) count_incomplete(part.revolution);
      return std::nullopt;
    }
    const std::size_t expected = part.points.size() * part.parts;
    if (part.parts > 1) part.points.reserve(std::min(expected, kLargestReserve));
    pending_ = std::move(part);
    next_part_ = 1;
  } else {
    pending_->points.insert(pending_->points.end(), part.points.begin(), part.points.end());
    ++next_part_;
  }

  if (next_part_ < pending_->parts) return std::nullopt;
  std::optional<PointSweep> whole = std::exchange(pending_, std::nullopt);
  whole->parts = 1;
  return whole;
}

void SweepAssembler::count_incomplete(std::uint64_t revolution) {
  ++incomplete_;
  lost_revolution_ = revolution;
}

}  // namespace understory::model
