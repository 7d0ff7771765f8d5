#include "common/map_merge/fusion.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <limits>
#include <map>
#include <stdexcept>

#include "common/constellation/grid.hpp"

namespace understory::map_merge {
namespace {

using map_file::StoredLandmark;
using map_file::StoredMap;

constexpr double kFusionCell_m = 2.0;
/// Keeps sums of singular covariances invertible [m^2].
constexpr double kLeastVariance_m2 = 1e-10;

/// Transforms the second map into the first map's frame by the alignment.
class Mover {
 public:
  Mover(const Alignment& alignment, double unknown_sigma_m)
      : motion_{alignment.first_T_second, alignment.covariance},
        rotation_(alignment.first_T_second.rotation()),
        unknown_m2_(unknown_sigma_m * unknown_sigma_m) {}

  Eigen::Matrix2d known(const Eigen::Matrix2d& covariance_m2) const {
    if (!covariance_m2.isZero(0.0)) return covariance_m2;
    return unknown_m2_ * Eigen::Matrix2d::Identity();
  }
  Eigen::Vector2d position(const Eigen::Vector2d& in_second_m) const {
    return motion_.mean * in_second_m;
  }
  /// The rotated covariance without the error of the motion.
  Eigen::Matrix2d turned(const Eigen::Matrix2d& covariance_m2) const {
    return rotation_ * known(covariance_m2) * rotation_.transpose();
  }
  /// Covariance of a moved landmark, with the error of the motion.
  Eigen::Matrix2d covariance(const model::MapLandmark& landmark) const {
    Eigen::Matrix<double, 2, 3> jacobian;
    jacobian << rotation_, rotation_ * geometry::perpendicular(landmark.position_m);
    return symmetric(turned(landmark.covariance_m2) +
                     jacobian * motion_.covariance * jacobian.transpose());
  }
  /// A covariance that was not computed stays zero.
  model::KeyframePose moved(model::KeyframePose pose) const {
    const geometry::SE2WithCovariance there =
        geometry::compound(motion_, {pose.map_T_vehicle, pose.covariance});
    pose.map_T_vehicle = there.mean;
    if (!pose.covariance.isZero(0.0))
      pose.covariance = 0.5 * (there.covariance + there.covariance.transpose());
    return pose;
  }
  static Eigen::Matrix2d symmetric(const Eigen::Matrix2d& matrix) {
    return 0.5 * (matrix + matrix.transpose());
  }

 private:
  geometry::SE2WithCovariance motion_;
  Eigen::Matrix2d rotation_;
  double unknown_m2_;
};

double fused_radius(const model::MapLandmark& a, const model::MapLandmark& b) {
  if (!(a.radius_m > 0.0)) return b.radius_m;
  if (!(b.radius_m > 0.0)) return a.radius_m;
  const double a_count = std::max(1.0, static_cast<double>(a.observation_count));
  const double b_count = std::max(1.0, static_cast<double>(b.observation_count));
  return (a_count * a.radius_m + b_count * b.radius_m) / (a_count + b_count);
}

std::uint32_t sum_of_counts(std::uint32_t a, std::uint32_t b) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint32_t>::max();
  return static_cast<std::uint32_t>(std::min(kMost, std::uint64_t{a} + b));
}

/// Fuses both positions, weighted by the information of their independent parts.
void fuse_places(model::MapLandmark& a, const model::MapLandmark& b, const Mover& mover,
                 double share) {
  const Eigen::Matrix2d stated = mover.known(a.covariance_m2);
  const Eigen::Matrix2d floor = kLeastVariance_m2 * Eigen::Matrix2d::Identity();
  const Eigen::Matrix2d own = share * stated + floor;
  const Eigen::Matrix2d other = share * mover.turned(b.covariance_m2) + floor;
  const Eigen::Matrix2d gain = own * (own + other).inverse();

  a.position_m += gain * (mover.position(b.position_m) - a.position_m);
  a.covariance_m2 = Mover::symmetric((1.0 - share) * stated + own - gain * own);
}

StoredLandmark fused_landmark(const StoredLandmark& a, const StoredLandmark& b, const Mover& mover,
                              double share, bool is_second_younger) {
  StoredLandmark result = a;
  fuse_places(result.landmark, b.landmark, mover, share);
  result.landmark.radius_m = fused_radius(a.landmark, b.landmark);
  result.landmark.observation_count =
      sum_of_counts(a.landmark.observation_count, b.landmark.observation_count);
  if (b.existence && (is_second_younger || !a.existence)) result.existence = b.existence;
  return result;
}

StoredMap moved_trajectory(const StoredMap& second, const Mover& mover) {
  StoredMap moved = second;
  moved.landmarks.clear();
  moved.existence.reset();
  for (model::KeyframePose& pose : moved.keyframes) pose = mover.moved(pose);
  for (map_file::SubmapBorder& border : moved.submap_borders) {
    for (Eigen::Vector2d& corner : border.corners_m) corner = mover.position(corner);
  }
  for (map_file::LoopClosure& loop : moved.loop_closures) {
    loop.from_m = mover.position(loop.from_m);
    loop.to_m = mover.position(loop.to_m);
  }
  return moved;
}

/// Adds landmarks of the second map to the first one's.
class Adder {
 public:
  Adder(MergedMaps& merged, const Mover& mover, double suspicious_m)
      : merged_(merged), mover_(mover), suspicious_m_(suspicious_m), grid_(kFusionCell_m) {
    constexpr model::LandmarkId kCounter =
        (model::LandmarkId{1} << model::kLandmarkCounterBits) - 1;
    const auto& landmarks = merged.map.landmarks;
    if (!landmarks.empty()) last_counter_ = landmarks.back().landmark.id & kCounter;
    for (std::uint32_t i = 0; i < landmarks.size(); ++i) {
      const Eigen::Vector2d& at = landmarks[i].landmark.position_m;
      if (constellation::PointGrid::representable(at)) grid_.insert(i, at);
    }
  }

  void add(const StoredLandmark& one) {
    StoredLandmark added = one;
    added.submap_id.reset();  // It is a number of the second map's submaps.
    added.landmark.position_m = mover_.position(one.landmark.position_m);
    added.landmark.covariance_m2 = mover_.covariance(one.landmark);
    added.landmark.id = map_file::landmark_id(merged_.map.map_id, ++last_counter_);
    if (has_neighbour(added.landmark.position_m)) ++merged_.suspected_doubles;

    merged_.renamed.emplace_back(one.landmark.id, added.landmark.id);
    merged_.map.landmarks.push_back(added);
    ++merged_.added;
  }

 private:
  bool has_neighbour(const Eigen::Vector2d& at) const {
    if (!constellation::PointGrid::representable(at)) return false;
    bool has_one = false;
    grid_.for_each_within(
        at.x(), at.y(), suspicious_m_,
        [&](constellation::Slot /*slot*/, double /*squared*/) { has_one = true; });
    return has_one;
  }

  MergedMaps& merged_;
  const Mover& mover_;
  double suspicious_m_;
  constellation::PointGrid grid_;  ///< Positions of the first map's landmarks.
  std::uint64_t last_counter_ = 0;
};

using ExistenceRows = std::map<model::LandmarkId, map_file::ExistenceRow>;

/// States of the second map under the ids that its landmarks have now; `renamed` is in order.
ExistenceRows renamed_states(
    const map_file::StoredExistence& second,
    const std::vector<std::pair<model::LandmarkId, model::LandmarkId>>& renamed) {
  ExistenceRows rows;
  auto next = renamed.begin();
  for (map_file::ExistenceRow row : second.landmarks) {
    while (next != renamed.end() && next->first < row.existence.id) ++next;
    if (next == renamed.end() || next->first != row.existence.id) continue;
    row.existence.id = next->second;
    rows[row.existence.id] = row;
  }
  return rows;
}

/// `merged.map` has the states of the first map, `merged.renamed` is complete and in order.
void fuse_existence(MergedMaps& merged, const StoredMap& second) {
  const auto& first = merged.map.existence;
  if (!first && !second.existence) return;
  map_file::StoredExistence fused = first ? *first : *second.existence;
  ExistenceRows rows;
  if (second.existence) {
    rows = renamed_states(*second.existence, merged.renamed);
    if (second.existence->utime > fused.utime) fused.learned = second.existence->learned;
    fused.utime = std::max(fused.utime, second.existence->utime);
  }

  if (first) {
    for (const map_file::ExistenceRow& row : first->landmarks) {
      const auto [at, is_new] = rows.try_emplace(row.existence.id, row);
      if (!is_new && at->second.utime <= row.utime) at->second = row;
    }
  }

  fused.landmarks.clear();
  for (const auto& [id, row] : rows) fused.landmarks.push_back(row);
  map_file::give_existence(merged.map, fused);
}

}  // namespace

MergedMaps fuse(const StoredMap& first, const StoredMap& second, const Alignment& alignment,
                const FusionParameters& parameters) {
  if (!alignment.found() || first.map_id == second.map_id)
    throw std::invalid_argument("fuse: no alignment, or maps of one number");
  const Mover mover(alignment, parameters.unknown_sigma_m);
  const bool is_second_younger = second.created_utime >= first.created_utime;
  MergedMaps merged;
  merged.map = first;
  merged.trajectory = moved_trajectory(second, mover);
  std::vector<bool> is_fused(second.landmarks.size(), false);

  for (const LandmarkPair& pair : alignment.pairs) {
    const StoredLandmark& other = second.landmarks[pair.second];
    StoredLandmark& one = merged.map.landmarks[pair.first];
    one = fused_landmark(one, other, mover, pair.independent_share, is_second_younger);
    merged.renamed.emplace_back(other.landmark.id, one.landmark.id);
    is_fused[pair.second] = true;
  }
  merged.fused = alignment.pairs.size();

  Adder adder(merged, mover, parameters.suspicious_m);
  for (std::size_t i = 0; i < second.landmarks.size(); ++i) {
    if (!is_fused[i]) adder.add(second.landmarks[i]);
  }
  std::ranges::sort(merged.renamed);
  fuse_existence(merged, second);
  return merged;
}

std::vector<model::MapLandmark> landmarks_of(const StoredMap& map) {
  std::vector<model::MapLandmark> landmarks;
  landmarks.reserve(map.landmarks.size());
  for (const StoredLandmark& one : map.landmarks) landmarks.push_back(one.landmark);
  return landmarks;
}

}  // namespace understory::map_merge
