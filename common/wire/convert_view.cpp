#include <cmath>
#include <numbers>

#include "common/wire/convert.hpp"
#include "common/wire/convert_shared.hpp"

namespace understory::wire {
namespace {

constexpr double kWholeTurn = 2.0 * std::numbers::pi;
/// More bins than any sensor has beams.
constexpr double kMostBins = 1e5;

void check_bins(const view_ranges_t& wire, Checks& checks) {
  for (const double coordinate : wire.sensor_m)
    checks.range("sensor_m", coordinate, -kLongestRangeM, kLongestRangeM);
  for (const double coordinate : wire.turn_m)
    checks.range("turn_m", coordinate, -kLongestRangeM, kLongestRangeM);
  checks.range("first_bearing_rad", wire.first_bearing_rad, -kWholeTurn, kWholeTurn);
  checks.range("beam_step_rad", wire.beam_step_rad, 1e-6, kWholeTurn);
  checks.range("range_step_m", wire.range_step_m, 1e-3, kLongestRangeM);
  checks.range("num_bins", wire.num_bins, 0.0, kMostBins);
  checks.range("step_rad", std::abs(wire.step_rad), 1e-6, kWholeTurn);
  checks.consistent(std::abs(wire.step_rad) * wire.num_bins <= kWholeTurn + 1e-6,
                    "the bins are one turn at most");
}

}  // namespace

Result<model::ViewRanges> from_wire(const view_ranges_t& wire) {
  Checks checks;
  check_bins(wire, checks);
  if (checks.refusal()) return *checks.refusal();
  model::ViewRanges ranges;
  take_stamp(wire, ranges);
  ranges.sensor_m = Eigen::Map<const Eigen::Vector2d>(wire.sensor_m);
  ranges.turn_m = Eigen::Map<const Eigen::Vector2d>(wire.turn_m);
  ranges.first_bearing_rad = wire.first_bearing_rad;
  ranges.step_rad = wire.step_rad;
  ranges.beam_step_rad = wire.beam_step_rad;
  ranges.range_step_m = wire.range_step_m;
  ranges.free = wire.free;
  ranges.hidden = wire.hidden;
  return ranges;
}

view_ranges_t to_wire(const model::ViewRanges& ranges) {
  view_ranges_t wire{};
  put_stamp(ranges, wire);
  copy_vector(ranges.sensor_m, wire.sensor_m);
  copy_vector(ranges.turn_m, wire.turn_m);
  wire.first_bearing_rad = ranges.first_bearing_rad;
  wire.step_rad = ranges.step_rad;
  wire.beam_step_rad = ranges.beam_step_rad;
  wire.range_step_m = ranges.range_step_m;
  wire.num_bins = static_cast<std::int32_t>(ranges.free.size());
  wire.free = ranges.free;
  wire.hidden = ranges.hidden;
  return wire;
}

}  // namespace understory::wire
