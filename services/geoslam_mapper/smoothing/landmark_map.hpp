// The landmarks of the map, and which of them have changed.
#pragma once

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "common/constellation/map.hpp"
#include "common/model/archive.hpp"
#include "common/model/map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Number of a node of the pose graph, in order of time.
using NodeIndex = std::uint32_t;

/// Data of a landmark beside its position in the graph.
struct StoredLandmark {
  model::LandmarkId id = 0;
  /// Frame `map`; copied from the graph once the landmark is in it.
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  /// Of a landmark of a given map [m^2], frame `map`; zero for all others.
  Eigen::Matrix2d prior_covariance = Eigen::Matrix2d::Zero();
  double information = 0.0;             ///< Sum of 1 / variance of its observations [1/m^2].
  double radius_m = 0.0;                ///< Mean over its observations; 0 for corners.
  std::uint32_t observation_count = 0;  ///< Scans in which it was detected.
  std::uint32_t last_keyframe = 0;      ///< Number of accepted keyframes at its last observation.
  std::vector<NodeIndex> nodes;         ///< Nodes that observed it, each once, the latest last.
  /// Path length of the vehicle [m] at the nodes that observed it, before these were condensed; the
  /// latest kMostViews.
  std::vector<float> views_m;
  model::LandmarkKind kind = model::LandmarkKind::kTrunk;
  bool is_late = false;    ///< Its position in the index is outdated.
  bool is_unused = false;  ///< Out of use: it is in the index of unused landmarks only.

  /// Variance [m^2] of the position relative to the keyframes that observed it.
  double local_variance() const { return 1.0 / information; }
  static constexpr std::size_t kMostViews = 64;
  /// Whether it belongs to the given map. It enters the graph with its prior when it is first
  /// observed or examined for merging.
  bool is_given() const { return !prior_covariance.isZero(0.0); }
  bool is_given_unseen() const { return is_given() && last_keyframe == 0; }
  /// Records an observation at this path length.
  void viewed_at(double along_m) {
    const auto view_m = static_cast<float>(along_m);
    if (!views_m.empty() && views_m.back() == view_m) return;
    if (views_m.size() == kMostViews) views_m.erase(views_m.begin());
    views_m.push_back(view_m);
  }
  /// Records an observation by a node. O(nodes).
  void observed_from(NodeIndex node) {
    if (!nodes.empty() && nodes.back() == node) return;
    std::erase(nodes, node);
    nodes.push_back(node);
  }
  /// Moves a node's observations to another node. O(nodes).
  void replace(NodeIndex node, NodeIndex by) {
    const auto found = std::find(nodes.begin(), nodes.end(), node);
    if (found == nodes.end()) return;
    if (std::find(nodes.begin(), nodes.end(), by) == nodes.end()) {
      *found = by;
    } else {
      nodes.erase(found);
    }
  }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.id, s.position_m, s.prior_covariance, s.information, s.radius_m, s.observation_count,
      s.last_keyframe, s.nodes, s.views_m, s.kind, s.is_late, s.is_unused);
  }
};

/// Landmarks by id, with a dynamic index over their positions. Each change costs as much as it
/// touches.
class LandmarkMap {
 public:
  /// Largest distance [m] between a landmark and its position in the index; see move().
  static constexpr double kStaleness_m = 0.25;

  /// No landmarks yet; new ones get ids of map `map_id`.
  explicit LandmarkMap(std::uint32_t map_id = 1)
      : next_id_((model::LandmarkId{map_id} << model::kLandmarkCounterBits) | 1U) {}

  /// Adds a landmark of a given map (GeoSLAM §4.3.1). One without id gets the next one; one without
  /// covariance gets `sigma_m` per axis.
  void add_given(const model::MapLandmark& given, double sigma_m);
  /// Adds a new landmark with a new id, ignoring its `id`; returns the new id.
  model::LandmarkId insert(StoredLandmark landmark);
  /// Removes a landmark; its id is never used again.
  void remove(model::LandmarkId id);
  /// Removes a landmark that is stored elsewhere from now on. Throws std::out_of_range if there is
  /// none.
  StoredLandmark put_away(model::LandmarkId id);
  /// Adds a landmark that was stored elsewhere.
  void bring_back(StoredLandmark landmark);
  /// Removes and returns all landmarks, in order of id.
  std::vector<StoredLandmark> release();
  /// Moves a landmark (frame `map`). The index follows at once if it is off by kStaleness_m,
  /// otherwise at the next catch_up(); its triangles always at catch_up().
  void move(model::LandmarkId id, const Eigen::Vector2d& position_m);

  /// The landmark of an id. Throws std::out_of_range if there is none.
  StoredLandmark& at(model::LandmarkId id) { return landmarks_.at(id); }
  const StoredLandmark& at(model::LandmarkId id) const { return landmarks_.at(id); }
  /// All landmarks by id, ascending.
  const std::map<model::LandmarkId, StoredLandmark>& all() const { return landmarks_; }
  /// Whether the map has landmarks of a given map.
  bool has_given() const { return has_given_; }
  /// Whether there is no landmark.
  bool empty() const { return landmarks_.empty(); }

  /// Index over the landmarks in use; positions in it may be off by kStaleness_m.
  const constellation::ConstellationMap& index() const { return index_; }
  /// Index over the landmarks out of use: not used for localisation, but sightings of them are
  /// reported.
  const constellation::ConstellationMap& unused_index() const { return unused_index_; }
  /// Sets whether the landmark is in use; does nothing if there is no such landmark.
  void set_in_use(model::LandmarkId id, bool is_in_use);
  /// Brings the index to within a centimetre and its triangles up to date, before a search by
  /// descriptors. O(moved landmarks).
  void catch_up();

  /// Number of the map: upper 16 bit of new ids.
  std::uint32_t map_id() const { return model::map_of(next_id_); }

  /// Sets the landmarks around the vehicle whose association is ambiguous by position, ascending.
  void set_loose(std::vector<model::LandmarkId> ids) { loose_ = std::move(ids); }
  /// Whether the landmark's association is ambiguous. O(log n).
  bool is_loose(model::LandmarkId id) const {
    return std::binary_search(loose_.begin(), loose_.end(), id);
  }

  /// Ids of landmarks that are new or moved since the last call, ascending, without removed ones.
  std::vector<model::LandmarkId> take_changed();
  /// Reports all landmarks as changed: after a load, when the graph was solved anew.
  void mark_all_changed();

  /// Members of a saved state; see common/state. `changed_` is not among them: after a load all
  /// landmarks are reported as changed.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    std::vector<Eigen::Vector2d> indexed_m = self.indexed_positions();
    a(self.landmarks_, self.late_, self.loose_, self.next_id_, indexed_m);
    if constexpr (Archive::kReads) self.rebuild_index(indexed_m);
  }

 private:
  void put(const StoredLandmark& landmark);
  void forget_gone_late();
  constellation::ConstellationMap& index_of(const StoredLandmark& landmark) {
    return landmark.is_unused ? unused_index_ : index_;
  }
  std::vector<Eigen::Vector2d> indexed_positions() const;
  void rebuild_index(const std::vector<Eigen::Vector2d>& indexed_m);

  std::map<model::LandmarkId, StoredLandmark> landmarks_;
  constellation::ConstellationMap index_;
  constellation::ConstellationMap unused_index_;
  std::vector<model::LandmarkId> late_;     ///< All with is_late, and at most as many others.
  std::vector<model::LandmarkId> changed_;  ///< With repetitions.
  std::vector<model::LandmarkId> loose_;    ///< Ascending.
  model::LandmarkId next_id_;
  bool has_given_ = false;
};

}  // namespace understory::geoslam_mapper::smoothing
