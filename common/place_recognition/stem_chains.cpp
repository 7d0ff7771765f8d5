#include "common/place_recognition/stem_chains.hpp"

#include <algorithm>
#include <cmath>

#include "common/constellation/triangles.hpp"
#include "common/place_recognition/hypotheses.hpp"

namespace understory::place_recognition {
namespace {

/// A stem that less than this share of the frames in whose range it is saw is doubted.
constexpr double kExpectedShare = 0.3;
constexpr double kLeastWeight = 0.1;

/// A stem as several frames saw it.
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
  const auto last_T_frame = aligned(own, diameters);
  frame.chain = last_T_frame ? chains_ : ++chains_;
  if (last_T_frame) frame.chain_T_frame = frames_.back().chain_T_frame * *last_T_frame;
  frames_.push_back(std::move(frame));
}

/// In the frame of the last one.
std::optional<geometry::SE2> StemChains::aligned(std::span<const LevelStem> stems,
                                                 const DiameterSpread& diameters) const {
  if (frames_.empty() || stems.size() < 3) return std::nullopt;
  const std::vector<LevelStem> last = frames_.back().stems.unpacked();
  TripletIndex index(parameters_.side_tolerance_m);
  index.add(last, stem_triangles(last, triangles_));
  HypothesisFilter filter;
  filter.side_tolerance_m = parameters_.side_tolerance_m;
  filter.max_distance_m = parameters_.max_step_m;
  const auto hypotheses = index.hypotheses(stems, stem_triangles(stems, triangles_), filter);

  std::vector<PlaceCluster> clusters;
  collect_clusters(hypotheses, clusters);
  const StemLikelihood seen(view(frames_.size() - 1, frames_.size()), noise_, diameters);
  std::optional<geometry::SE2> best;
  double best_ratio = parameters_.least_log_ratio;
  for (const PlaceCluster& cluster : clusters) {
    const geometry::SE2 pose = seen.refined(stems, cluster.frame_T_query);
    const double ratio = seen.log_ratio(stems, pose);
    if (ratio < best_ratio) continue;
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

  // The frame itself first, then ever farther ones: its own positions attract the others.
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
