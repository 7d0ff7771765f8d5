#include "common/model/point_sweep.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace understory::model {

namespace {

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

bool SweepAssembler::Pending::takes(const PointSweep& part) const {
  const PointSweep& one = parts.front();
  return one.revolution == part.revolution && one.utime == part.utime && one.parts == part.parts;
}

PointSweep SweepAssembler::Pending::join() && {
  std::ranges::sort(parts, {}, &PointSweep::part);
  PointSweep whole = std::move(parts.front());
  std::size_t points = whole.points.size();
  for (std::size_t i = 1; i < parts.size(); ++i) points += parts[i].points.size();
  whole.points.reserve(points);
  for (std::size_t i = 1; i < parts.size(); ++i)
    whole.points.insert(whole.points.end(), parts[i].points.begin(), parts[i].points.end());
  whole.parts = 1;
  return whole;
}

std::optional<PointSweep> SweepAssembler::add(PointSweep part) {
  // Find its revolution: a pending or a new one.
  const auto takes = [&part](const Pending& pending) { return pending.takes(part); };
  auto pending = std::ranges::find_if(pending_, takes);
  if (pending == pending_.end()) {
    if (latest_ == part.utime) return std::nullopt;
    if (pending_.size() >= kMostPending) drop_oldest();
    pending = pending_.insert(pending_.end(), Pending{});
  } else if (std::ranges::count(pending->parts, part.part, &PointSweep::part) > 0) {
    return std::nullopt;
  }

  // Is it complete?
  const std::size_t wanted = std::max<std::size_t>(1, part.parts);
  pending->parts.push_back(std::move(part));
  if (pending->parts.size() < wanted) return std::nullopt;
  while (pending_.begin() != pending) drop_oldest();
  PointSweep whole = std::move(*pending).join();
  pending_.pop_front();
  latest_ = whole.utime;
  return whole;
}

void SweepAssembler::drop_oldest() {
  latest_ = pending_.front().parts.front().utime;
  pending_.pop_front();
  ++incomplete_;
}

}  // namespace understory::model
