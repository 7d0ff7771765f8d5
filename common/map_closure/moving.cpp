// Moves a map with its parts.
#include <algorithm>
#include <limits>
#include <numbers>
#include <optional>
#include <unordered_map>

#include "common/constellation/grid.hpp"
#include "common/geometry/decompositions.hpp"
#include "common/map_closure/closing.hpp"

namespace understory::map_closure {
namespace {

using map_file::StoredMap;

/// Smaller moves of a part do not count.
constexpr double kMoved_m = 1e-3;
constexpr double kTurned_rad = 0.01 * std::numbers::pi / 180.0;
/// A covariance is not reduced below this share of its old value, in any direction.
constexpr double kLeastShare = 1e-2;

/// The move of one part.
struct Move {
  geometry::SE2 now_T_before;  ///< In frame `map`.
  geometry::SE2 map_T_part;    ///< Before the move.
  /// Change of the covariance of the part's pose, if the covariances of its content include it.
  std::optional<Eigen::Matrix3d> change;
};

template <int N>
Eigen::Matrix<double, N, N> symmetric(const Eigen::Matrix<double, N, N>& matrix) {
  return 0.5 * (matrix + matrix.transpose());
}

/// The changed covariance; `before` where the result would not be positive definite: the two then
/// belong to different estimates.
template <int N>
Eigen::Matrix<double, N, N> changed(const Eigen::Matrix<double, N, N>& before,
                                    const Eigen::Matrix<double, N, N>& change) {
  const Eigen::Matrix<double, N, N> after = symmetric<N>(before + change);
  const double least = kLeastShare * geometry::eigenvalues(before)[0];
  return geometry::eigenvalues(after)[0] >= least ? after : before;
}

void move(model::KeyframePose& pose, const Move& by) {
  if (by.change && !pose.covariance.isZero(0.0)) {
    const Eigen::Matrix3d adjoint =
        (by.map_T_part.inverse() * pose.map_T_vehicle).inverse().Adjoint();
    pose.covariance = changed<3>(pose.covariance, adjoint * *by.change * adjoint.transpose());
  }
  pose.map_T_vehicle = by.now_T_before * pose.map_T_vehicle;
}

void move(model::MapLandmark& landmark, const Move& by) {
  if (!landmark.covariance_m2.isZero(0.0)) {
    Eigen::Matrix2d covariance = landmark.covariance_m2;
    if (by.change) {
      const Eigen::Matrix2d rotation = by.map_T_part.rotation();
      Eigen::Matrix<double, 2, 3> j;
      j << rotation,
          rotation * geometry::perpendicular(by.map_T_part.inverse() * landmark.position_m);
      covariance = changed<2>(covariance, j * *by.change * j.transpose());
    }
    const Eigen::Matrix2d turn = by.now_T_before.rotation();
    landmark.covariance_m2 = symmetric<2>(turn * covariance * turn.transpose());
  }
  landmark.position_m = by.now_T_before * landmark.position_m;
}

std::vector<Move> moves_of(const PartGraph& graph, const ClosedGraph& closed) {
  std::vector<Move> moves(graph.parts.size());
  for (std::size_t i = 0; i < moves.size(); ++i) {
    moves[i].map_T_part = graph.parts[i].map_T_part;
    moves[i].now_T_before = closed.poses[i] * moves[i].map_T_part.inverse();
    if (graph.parts[i].is_held) moves[i].change = closed.after[i] - closed.before[i];
  }
  return moves;
}

/// Moves borders and the ends of closures.
void move_drawings(StoredMap& map, const PartGraph& graph, const std::vector<Move>& moves) {
  std::unordered_map<model::SubmapId, std::size_t> of_submap;
  std::unordered_map<std::uint64_t, std::size_t> of_keyframe;
  for (std::size_t i = 0; i < graph.parts.size(); ++i) {
    if (graph.parts[i].submap != 0) of_submap[graph.parts[i].submap] = i;
    for (const std::uint32_t k : graph.parts[i].keyframes)
      of_keyframe[map.keyframes[k].keyframe_sequence] = i;
  }

  for (map_file::SubmapBorder& border : map.submap_borders) {
    const auto part = of_submap.find(border.submap_id);
    if (part == of_submap.end()) continue;
    for (Eigen::Vector2d& corner : border.corners_m)
      corner = moves[part->second].now_T_before * corner;
  }
  const auto move_end = [&](std::uint64_t sequence, Eigen::Vector2d& at) {
    const auto part = of_keyframe.find(sequence);
    if (part != of_keyframe.end()) at = moves[part->second].now_T_before * at;
  };
  for (map_file::LoopClosure& loop : map.loop_closures) {
    move_end(loop.from_sequence, loop.from_m);
    move_end(loop.to_sequence, loop.to_m);
  }
}

/// Finds landmarks of a map by position, with their parts.
class Neighbours {
 public:
  Neighbours(const StoredMap& map, const PartGraph& graph, double within_m)
      : map_(map), grid_(within_m), within_m_(within_m), part_of_(map.landmarks.size()) {
    for (std::size_t i = 0; i < graph.parts.size(); ++i)
      for (const std::uint32_t landmark : graph.parts[i].landmarks) part_of_[landmark] = i;
    for (std::uint32_t i = 0; i < map.landmarks.size(); ++i) {
      const Eigen::Vector2d& at = map.landmarks[i].landmark.position_m;
      if (constellation::PointGrid::representable(at)) grid_.insert(i, at);
    }
  }

  /// The nearest one in another part that is not adjacent on the path; itself where there is none.
  std::uint32_t nearest(std::uint32_t landmark) const {
    const model::MapLandmark& one = map_.landmarks[landmark].landmark;
    std::uint32_t best = landmark;
    if (!constellation::PointGrid::representable(one.position_m)) return best;
    double least = std::numeric_limits<double>::infinity();
    grid_.for_each_within(one.position_m.x(), one.position_m.y(), within_m_,
                          [&](constellation::Slot other, double squared) {
                            if (!is_candidate(landmark, other) || squared >= least) return;
                            least = squared;
                            best = other;
                          });
    return best;
  }

 private:
  bool is_candidate(std::uint32_t a, std::uint32_t b) const {
    const std::size_t low = std::min(part_of_[a], part_of_[b]);
    const std::size_t high = std::max(part_of_[a], part_of_[b]);
    return high - low > 1 && map_.landmarks[a].landmark.kind == map_.landmarks[b].landmark.kind;
  }

  const StoredMap& map_;
  constellation::PointGrid grid_;
  double within_m_;
  std::vector<std::size_t> part_of_;
};

}  // namespace

StoredMap moved(const StoredMap& map, const PartGraph& graph, const ClosedGraph& closed,
                Shifts& shifts) {
  const std::vector<Move> moves = moves_of(graph, closed);
  StoredMap result = map;
  shifts = {};
  const auto note_shift = [&](const Eigen::Vector2d& before, const Eigen::Vector2d& after) {
    shifts.landmark_m = std::max(shifts.landmark_m, (after - before).norm());
  };

  for (std::size_t i = 0; i < moves.size(); ++i) {
    const Move& by = moves[i];
    for (const std::uint32_t k : graph.parts[i].keyframes) {
      move(result.keyframes[k], by);
      note_shift(map.keyframes[k].map_T_vehicle.translation(),
                 result.keyframes[k].map_T_vehicle.translation());
    }
    for (const std::uint32_t landmark : graph.parts[i].landmarks) {
      move(result.landmarks[landmark].landmark, by);
      note_shift(map.landmarks[landmark].landmark.position_m,
                 result.landmarks[landmark].landmark.position_m);
    }

    const double turned_rad = std::abs(by.now_T_before.theta());
    const double moved_m = (closed.poses[i].translation() - by.map_T_part.translation()).norm();
    shifts.heading_rad = std::max(shifts.heading_rad, turned_rad);
    if (moved_m > kMoved_m || turned_rad > kTurned_rad) ++shifts.parts;
  }
  move_drawings(result, graph, moves);
  return result;
}

std::size_t coincident_pairs(const StoredMap& map, const PartGraph& graph, double within_m) {
  const Neighbours neighbours(map, graph, within_m);
  std::size_t pairs = 0;
  for (std::uint32_t i = 0; i < map.landmarks.size(); ++i) {
    const std::uint32_t other = neighbours.nearest(i);
    if (other > i && neighbours.nearest(other) == i) ++pairs;
  }
  return pairs;
}

}  // namespace understory::map_closure
