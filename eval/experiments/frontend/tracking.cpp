#include "eval/experiments/frontend/tracking.hpp"

#include <algorithm>
#include <map>
#include <vector>

#include "eval/tools/quantile.hpp"
#include "eval/tools/thread_clock.hpp"
#include "services/associator/associator.hpp"

namespace understory::eval::experiments::frontend {
namespace {

/// Which id each landmark has at the moment.
class SwitchCounter {
 public:
  /// Forgets landmarks that left the field of view.
  void forget_outside(const sim::TrunkField& world, const geometry::SE2& world_T_vehicle,
                      const model::FieldOfView& view) {
    const geometry::SE2 vehicle_T_world = world_T_vehicle.inverse();
    std::erase_if(current_, [&](const auto& entry) {
      const auto trunk = static_cast<std::size_t>(entry.first);
      return !view.contains(vehicle_T_world * world.forest.trunks_m[trunk]);
    });
  }
  void see(std::int64_t trunk, model::TrackId id) {
    const auto [entry, is_new] = current_.try_emplace(trunk, id);
    if (is_new || entry->second == id) return;
    entry->second = id;
    ++switches_;
  }
  std::uint64_t switches() const { return switches_; }

 private:
  std::map<std::int64_t, model::TrackId> current_;
  std::uint64_t switches_ = 0;
};

void count_purity(const std::map<model::TrackId, std::map<std::int64_t, std::uint64_t>>& seen,
                  TrackingResult& result) {
  std::uint64_t pure = 0;
  for (const auto& [id, trunks] : seen) {
    std::uint64_t most = 0;
    for (const auto& [trunk, count] : trunks) {
      if (trunk >= 0) most = std::max(most, count);
    }
    const auto false_ones = trunks.find(-1);
    if (false_ones != trunks.end() && false_ones->second > most) ++result.false_tracks;
    pure += most;
  }
  result.tracks = seen.size();
  result.purity =
      static_cast<double>(pure) / static_cast<double>(std::max<std::uint64_t>(1, result.published));
}

}  // namespace

TrackingResult run_tracking(const TrackingOptions& options, const sim::TrunkField& world,
                            std::uint64_t seed) {
  sim::InertialDrive drive(options.drive, world, seed);
  associator::Associator associator(options.associator);
  std::map<model::TrackId, std::map<std::int64_t, std::uint64_t>> seen;
  SwitchCounter switches;
  TrackingResult result;
  std::vector<double> times;
  std::uint64_t possible = 0;
  const auto scans = static_cast<std::size_t>(options.duration_s / options.drive.scan_interval_s);
  for (std::size_t k = 0; k < scans; ++k) {
    const sim::DriveStep step = drive.next();
    for (const model::Odometry& increment : step.odometry) associator.add(increment);
    const double before = tools::thread_time_s();
    const auto tracked = associator.add(step.scan);
    times.push_back(tools::thread_time_s() - before);
    switches.forget_outside(world, step.world_T_vehicle, step.scan.field_of_view);
    for (const model::TrackedLandmark& landmark : tracked->landmarks) {
      const std::int64_t trunk = step.trunks[landmark.detection];
      ++seen[landmark.track_id][trunk];
      if (trunk >= 0) switches.see(trunk, landmark.track_id);
    }
    result.published += tracked->landmarks.size();
    possible += static_cast<std::uint64_t>(
        std::count_if(step.trunks.begin(), step.trunks.end(), [](auto t) { return t >= 0; }));
    result.driven_km = 1e-3 * step.driven_m;
  }
  count_purity(seen, result);
  result.switches = switches.switches();
  result.switches_per_km = static_cast<double>(result.switches) / std::max(1e-3, result.driven_km);
  result.published_share = static_cast<double>(result.published) /
                           static_cast<double>(std::max<std::uint64_t>(1, possible));
  result.scans_lost = associator.counters().scans_lost;
  result.scan_p50_s = tools::quantile(times, 0.5);
  result.scan_p99_s = tools::quantile(times, 0.99);
  return result;
}

}  // namespace understory::eval::experiments::frontend
