// The existence tracker on 100 m of its way through a forest, with what it learns there, in maps of
// a thousand to a hundred thousand landmarks. Per keyframe:
//   bench_existence_tracker --benchmark_min_time=1
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <vector>

#include "services/existence_tracker/existence_tracker.hpp"

using namespace understory;

namespace {

constexpr double kRangeM = 15.0;
constexpr double kStepM = 2.0;
constexpr double kPerSquareM = 0.04;  ///< 400 stems a hectare.
constexpr int kKeyframes = 50;        ///< 100 m.
constexpr double kMissed = 0.36;      ///< Of the stems, per drive.

/// A forest of square shape with a road through its middle, mapped in full, on its second drive.
class Forest {
 public:
  explicit Forest(std::size_t landmarks)
      : side_m_(std::sqrt(static_cast<double>(landmarks) / kPerSquareM)) {
    std::uniform_real_distribution<double> across(-0.5 * side_m_, 0.5 * side_m_);
    map_.complete = true;
    for (std::size_t i = 0; i < landmarks; ++i) {
      model::MapLandmark one;
      one.id = i + 1;
      one.position_m = {across(random_), across(random_)};
      if (std::abs(one.position_m.y()) < kRangeM)
        beside_[metre_of(one.position_m.x())].push_back(one);
      map_.landmarks.push_back(one);
    }
    existence_tracker::TrackerParameters parameters;
    parameters.model.range_m = kRangeM;
    tracker_ = existence_tracker::ExistenceTracker(parameters);
    tracker_.on_map(map_);
    see_all();
    const auto states = tracker_.take_states();
    tracker_ = existence_tracker::ExistenceTracker(parameters);
    tracker_.begin_with(states);
    tracker_.on_map(map_);
    draw_missed();
  }

  /// One keyframe; at the end of the road it goes back.
  void drive() {
    place_m_ += forward_ ? kStepM : -kStepM;
    if (std::abs(place_m_) > 0.5 * side_m_ - 2.0 * kRangeM) forward_ = place_m_ < 0.0;
    utime_ += 1'000'000;
    model::MapUpdate update = update_at({place_m_, 0.0});
    const auto last = beside_.upper_bound(metre_of(place_m_ + kRangeM));
    for (auto metre = beside_.lower_bound(metre_of(place_m_ - kRangeM)); metre != last; ++metre)
      for (const model::MapLandmark& one : metre->second)
        if (std::hypot(one.position_m.x() - place_m_, one.position_m.y()) <= kRangeM)
          look(one.id, update);
    update.inliers = 10;
    benchmark::DoNotOptimize(tracker_.on_update(update));
  }

 private:
  static int metre_of(double x_m) { return static_cast<int>(std::floor(x_m)); }
  void look(model::LandmarkId id, model::MapUpdate& update) const {
    if (missed_[id])
      update.expected.push_back({id});
    else
      update.associations.push_back({static_cast<std::uint32_t>(update.associations.size()), id});
  }
  model::MapUpdate update_at(const Eigen::Vector2d& place_m) const {
    model::MapUpdate update;
    update.status = model::MapUpdateStatus::kUpdated;
    update.utime = utime_;
    update.map_T_vehicle = {place_m.x(), place_m.y(), 0.0};
    return update;
  }
  /// What a survey would have done: each landmark seen five times, from one place.
  void see_all() {
    model::MapUpdate update = update_at({0.01, 0.02});
    for (const model::MapLandmark& one : map_.landmarks)
      update.associations.push_back(
          {static_cast<std::uint32_t>(update.associations.size()), one.id});
    for (int i = 0; i < 5; ++i) {
      update.utime = utime_ += 1'000'000;
      tracker_.on_update(update);
    }
    utime_ += 30 * 86'400'000'000;
  }
  void draw_missed() {
    std::bernoulli_distribution is_missed(kMissed);
    missed_.resize(map_.landmarks.size() + 1);
    for (std::size_t i = 1; i < missed_.size(); ++i) missed_[i] = is_missed(random_);
  }

  std::mt19937_64 random_{1};
  double side_m_;
  model::WholeMap map_;
  std::map<int, std::vector<model::MapLandmark>> beside_;  ///< The road, by metres of it.
  std::vector<bool> missed_;
  existence_tracker::ExistenceTracker tracker_;
  double place_m_ = 0.0;
  bool forward_ = true;
  model::Utime utime_ = 1;
};

void BM_Drive100m(benchmark::State& state) {
  Forest forest(static_cast<std::size_t>(state.range(0)));
  for (int i = 0; i < 2 * kKeyframes; ++i) forest.drive();
  for (auto _ : state)
    for (int i = 0; i < kKeyframes; ++i) forest.drive();
  state.counters["time_per_keyframe"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * kKeyframes,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(BM_Drive100m)->Arg(1000)->Arg(10000)->Arg(100000)->Unit(benchmark::kMillisecond);

}  // namespace
