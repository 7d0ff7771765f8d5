#include "common/place_recognition/stem_chains.hpp"

#include <algorithm>
#include <cmath>

#include "common/constellation/triangles.hpp"
#include "common/place_recognition/hypotheses.hpp"

namespace understory::place_recognition {
namespace {

/// A stem has less weight if fewer than this share of the frames in whose range it is saw it.
constexpr double kExpectedShare = 0.3;
constexpr double kLeastWeight = 0.1;

/// A stem seen by several frames.
struct MergedStem {
  Eigen::Vector2d sum_m = Eigen::Vector2d::Zero();
  double seen = 0.0;
  double diameter_sum_m = 0.0;
  double diameters = 0.0;
  Eigen::Vector2d position_m() const { return sum_m / seen; }
};

/// Collects stems in one frame.
class StemMerger {
 public:
  explicit StemMerger(double merge_m) : merge_m2_(merge_m * merge_m) {}

  void add(const Eigen::Vector2d& position_m, double diameter_m) {
    MergedStem* nearest = nullptr;
    double nearest_m2 = merge_m2_;
    for (MergedStem& stem : stems_) {
      const double squared = (stem.position_m() - position_m).squaredNorm();
      if (squared >= nearest_m2) continue;
      nearest = &stem;
      nearest_m2 = squared;
    }
    if (nearest == nullptr) nearest = &stems_.emplace_back();
    nearest->sum_m += position_m;
    nearest->seen += 1.0;
    if (!(diameter_m > 0.0)) return;
    nearest->diameter_sum_m += diameter_m;
    nearest->diameters += 1.0;
  }
  const std::vector<MergedStem>& stems() const { return stems_; }

 private:
  double merge_m2_;
  std::vector<MergedStem> stems_;
};

}  // namespace

void StemChains::add(const PackedStems& stems, const DiameterSpread& diameters) {
  const std::vector<LevelStem> own = stems.unpacked();
  Frame frame;
  frame.stems = stems;
  frame.radius_m = static_cast<float>(extent_of(own).radius_m);
  for (std::size_t back = 1; back <= std::min(parameters_.gap, frames_.size()); ++back) {
    const Frame& earlier = frames_[frames_.size() - back];
    const auto earlier_T_frame = aligned(own, frames_.size() - back, diameters);
    if (!earlier_T_frame) continue;
    frame.chain = earlier.chain;
    frame.chain_T_frame = earlier.chain_T_frame * *earlier_T_frame;
    frame.step = geometry::SE2::Exp(earlier_T_frame->Log() / static_cast<double>(back));
    frames_.push_back(std::move(frame));
    return;
  }
  frame.chain = ++chains_;
  frames_.push_back(std::move(frame));
}

double StemChains::needed_log_ratio(const geometry::SE2& pose,
                                    const std::optional<geometry::SE2>& expected) const {
  if (!expected) return parameters_.least_log_ratio;
  const Eigen::Vector3d off = (expected->inverse() * pose).Log();
  const bool is_ahead =
      off.head<2>().norm() < parameters_.ahead_m && std::abs(off.z()) < parameters_.ahead_rad;
  return is_ahead ? parameters_.least_log_ratio_ahead : parameters_.least_log_ratio;
}

std::optional<geometry::SE2> StemChains::aligned(std::span<const LevelStem> stems,
                                                 std::size_t earlier,
                                                 const DiameterSpread& diameters) const {
  if (stems.size() < 3) return std::nullopt;
  const std::vector<LevelStem> known = frames_[earlier].stems.unpacked();
  TripletIndex index(parameters_.side_tolerance_m);
  index.add(known, stem_triangles(known, triangles_));
  HypothesisFilter filter;
  filter.side_tolerance_m = parameters_.side_tolerance_m;
  filter.max_distance_m = parameters_.max_step_m;
  std::vector<PlaceCluster> starts;
  collect_clusters(index.hypotheses(stems, stem_triangles(stems, triangles_), filter), starts);

  std::optional<geometry::SE2> expected;
  if (frames_[earlier].step) {
    const auto steps = static_cast<double>(frames_.size() - earlier);
    expected = geometry::SE2::Exp(steps * frames_[earlier].step->Log());
    starts.push_back({0, 0, *expected});
  }

  const StemLikelihood seen(view(earlier, frames_.size()), noise_, diameters);
  std::optional<geometry::SE2> best;
  double best_ratio = 0.0;
  for (const PlaceCluster& start : starts) {
    const geometry::SE2 pose = seen.refined(stems, start.frame_T_query);
    const double ratio = seen.log_ratio(stems, pose);
    if (ratio < std::max(best_ratio, needed_log_ratio(pose, expected))) continue;
    best = pose;
    best_ratio = ratio;
  }
  return best;
}

StemView StemChains::view(std::size_t frame, std::size_t end) const {
  const Frame& own = frames_[frame];
  StemView view;
  view.radius_m = own.radius_m + parameters_.beyond_m;
  StemMerger merger(parameters_.merge_m);
  std::vector<geometry::SE2> own_T_others;
  std::vector<double> radii_m;

  // The frame itself first, then farther ones, so that its own positions determine the merged ones.
  const auto take = [&](std::size_t other) {
    if (other >= std::min(end, frames_.size()) || frames_[other].chain != own.chain) return;
    const geometry::SE2 own_T_other = own.chain_T_frame.inverse() * frames_[other].chain_T_frame;
    for (const LevelStem& stem : frames_[other].stems.unpacked()) {
      const Eigen::Vector2d at = own_T_other * stem.position_m;
      if (at.norm() <= view.radius_m) merger.add(at, stem.diameter_m);
    }
    own_T_others.push_back(own_T_other);
    radii_m.push_back(frames_[other].radius_m);
  };
  take(frame);
  for (std::size_t step = 1; step <= parameters_.reach; ++step) {
    if (step <= frame) take(frame - step);
    take(frame + step);
  }

  for (const MergedStem& stem : merger.stems()) {
    double expected = 0.0;
    for (std::size_t i = 0; i < radii_m.size(); ++i)
      expected += (own_T_others[i].translation() - stem.position_m()).norm() <= radii_m[i];
    const double mean_diameter = stem.diameters > 0.0 ? stem.diameter_sum_m / stem.diameters : 0.0;
    view.stems.push_back({stem.position_m(), mean_diameter});
    view.weight.push_back(
        std::clamp(stem.seen / std::max(1.0, kExpectedShare * expected), kLeastWeight, 1.0));
  }
  return view;
}

std::optional<geometry::SE2> StemChains::between(std::size_t a, std::size_t b) const {
  const std::size_t apart = a > b ? a - b : b - a;
  if (apart > 2 * parameters_.reach || frames_[a].chain != frames_[b].chain) return std::nullopt;
  return frames_[a].chain_T_frame.inverse() * frames_[b].chain_T_frame;
}

}  // namespace understory::place_recognition
