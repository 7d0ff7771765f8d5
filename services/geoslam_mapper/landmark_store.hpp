// The landmarks of the mapper: those of the map, and candidates that may become such.
#pragma once

#include <map>
#include <vector>

#include "common/factor_graph/graph.hpp"
#include "common/hierarchy/constellation_map.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/map.hpp"

namespace understory {

/// Index of a keyframe's node in the mapper.
using NodeIndex = std::uint32_t;

struct StoredLandmark {
  LandmarkId id = 0;
  std::optional<PointId> point;  ///< None: given at the start and not observed yet.
  Eigen::Vector2d position_m =
      Eigen::Vector2d::Zero();  ///< Frame `map`; the graph's, where it has one.
  Eigen::Matrix2d prior_covariance = Eigen::Matrix2d::Zero();  ///< Of a given one.
  double information = 0.0;  ///< Sum over its detections of 1 / variance [1/m^2].
  double radius_m = 0.0;
  std::uint32_t times_seen = 0;
  std::uint32_t last_keyframe = 0;  ///< Count of keyframes when it was last seen.
  std::vector<NodeIndex> nodes;     ///< That saw it, ascending.
  LandmarkKind kind = LandmarkKind::kTrunk;
  bool is_late = false;  ///< Its place in the index is older than its position.

  /// Variance [m^2] of the position relative to the keyframes that saw it.
  double local_variance() const { return 1.0 / information; }
};

/// Seen, but too seldom yet to be believed.
struct Candidate {
  struct Sighting {
    NodeIndex node = 0;
    KeyframeLandmark landmark;  ///< In the node's centre frame.
  };
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< Frame `map`.
  std::vector<Sighting> sightings;
  std::uint32_t times_seen = 0;
  std::uint32_t times_in_view = 0;  ///< Scans that should have seen it, since it was first seen.
  std::uint32_t first_keyframe = 0;
  LandmarkKind kind = LandmarkKind::kTrunk;
};

/// Landmarks by id, with the dynamic index over their positions. Every change costs what it
/// touches.
class LandmarkStore {
 public:
  LandmarkId insert(StoredLandmark landmark);  ///< Gives it the next id.
  void restore(const StoredLandmark& landmark);
  void remove(LandmarkId id);
  /// Moves it; the index follows at once where the landmark is a `kStaleness_m` away from its place
  /// there, otherwise when catch_up() is called.
  void move(LandmarkId id, const Eigen::Vector2d& position_m);

  StoredLandmark& at(LandmarkId id) { return landmarks_.at(id); }
  const StoredLandmark& at(LandmarkId id) const { return landmarks_.at(id); }
  const std::map<LandmarkId, StoredLandmark>& all() const { return landmarks_; }
  std::map<LandmarkId, StoredLandmark>& all() { return landmarks_; }
  /// Index over all landmarks; places in it may be `kStaleness_m` old.
  const ConstellationMap& index() const { return index_; }
  /// Brings the index to within a centimetre: before a search by descriptors. O(what moved).
  void catch_up();
  bool empty() const { return landmarks_.empty(); }
  LandmarkId next_id() const { return next_id_; }
  void set_next_id(LandmarkId id) { next_id_ = id; }

  static constexpr double kStaleness_m = 0.25;

 private:
  std::map<LandmarkId, StoredLandmark> landmarks_;
  ConstellationMap index_;
  std::vector<LandmarkId> late_;                      ///< Those with is_late.
  LandmarkId next_id_ = (LandmarkId{1} << 48U) | 1U;  ///< Map 1, landmark 1.
};

}  // namespace understory
