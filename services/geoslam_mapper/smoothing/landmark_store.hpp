// The landmarks of the mapper: those of the map, and candidates that may become such.
#pragma once

#include <map>
#include <vector>

#include "common/constellation/map.hpp"
#include "common/factor_graph/plane/graph.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Index of a keyframe's node in the mapper.
using NodeIndex = std::uint32_t;

struct StoredLandmark {
  model::LandmarkId id = 0;
  std::optional<factor_graph::plane::PointId>
      point;  ///< None: given at the start and not observed yet.
  Eigen::Vector2d position_m =
      Eigen::Vector2d::Zero();  ///< Frame `map`; the graph's, where it has one.
  Eigen::Matrix2d prior_covariance = Eigen::Matrix2d::Zero();  ///< Of a given one.
  double information = 0.0;  ///< Sum over its detections of 1 / variance [1/m^2].
  double radius_m = 0.0;
  std::uint32_t observation_count = 0;
  std::uint32_t last_keyframe = 0;  ///< Count of keyframes when it was last seen.
  std::vector<NodeIndex> nodes;     ///< That saw it, ascending.
  model::LandmarkKind kind = model::LandmarkKind::kTrunk;
  bool is_late = false;  ///< Its place in the index is older than its position.

  /// Variance [m^2] of the position relative to the keyframes that saw it.
  double local_variance() const { return 1.0 / information; }
};

/// Seen, but too seldom yet to be believed.
struct Candidate {
  struct Observation {
    NodeIndex node = 0;
    model::KeyframeLandmark landmark;  ///< In the node's centre frame.
  };
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< Frame `map`.
  std::vector<Observation> observations;
  std::uint32_t observation_count = 0;
  std::uint32_t times_in_view = 0;  ///< Scans that should have seen it, since it was first seen.
  std::uint32_t first_keyframe = 0;
  model::LandmarkKind kind = model::LandmarkKind::kTrunk;
};

/// Landmarks by id, with the dynamic index over their positions. Every change costs what it
/// touches.
class LandmarkStore {
 public:
  model::LandmarkId insert(StoredLandmark landmark);  ///< Gives it the next id.
  void restore(const StoredLandmark& landmark);
  void remove(model::LandmarkId id);
  /// Moves it; the index follows at once where the landmark is a `kStaleness_m` away from its place
  /// there, otherwise when catch_up() is called.
  void move(model::LandmarkId id, const Eigen::Vector2d& position_m);

  StoredLandmark& at(model::LandmarkId id) { return landmarks_.at(id); }
  const StoredLandmark& at(model::LandmarkId id) const { return landmarks_.at(id); }
  const std::map<model::LandmarkId, StoredLandmark>& all() const { return landmarks_; }
  std::map<model::LandmarkId, StoredLandmark>& all() { return landmarks_; }
  /// Index over all landmarks; places in it may be `kStaleness_m` old.
  const constellation::ConstellationMap& index() const { return index_; }
  /// Brings the index to within a centimetre: before a search by descriptors. O(what moved).
  void catch_up();
  bool empty() const { return landmarks_.empty(); }
  model::LandmarkId next_id() const { return next_id_; }
  void set_next_id(model::LandmarkId id) { next_id_ = id; }

  static constexpr double kStaleness_m = 0.25;

 private:
  std::map<model::LandmarkId, StoredLandmark> landmarks_;
  constellation::ConstellationMap index_;
  std::vector<model::LandmarkId> late_;                             ///< Those with is_late.
  model::LandmarkId next_id_ = (model::LandmarkId{1} << 48U) | 1U;  ///< Map 1, landmark 1.
};

}  // namespace understory::geoslam_mapper::smoothing
