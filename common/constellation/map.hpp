// A map of identical landmarks, with one-shot localisation of an observation.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "common/constellation/grid.hpp"
#include "common/constellation/hermits.hpp"
#include "common/constellation/localisation.hpp"
#include "common/constellation/table.hpp"
#include "common/constellation/triangle_net.hpp"

namespace understory::constellation {

/// A landmark and its distance from the queried point.
struct NearestLandmark {
  LandmarkId id = 0;
  double distance_m = 0.0;
};

/// Landmarks by id, and the triangles that each forms with its nearest neighbours, by their side
/// lengths. Every change is made in place and costs only its neighbourhood; the result does not
/// depend on the order of changes. Memory: positions are stored twice, the present ones and those
/// of the triangles.
///
/// Positions must be finite and within constellation::PointGrid::kMaxCoordinate.
class ConstellationMap {
 public:
  using Parameters = MapParameters;  ///< Sizes of the look-up structures.
  /// Triangles are formed of a landmark and two of this many nearest neighbours.
  static constexpr std::size_t kNeighbours = TriangleNet::kNeighbours;

  /// An empty map with the default parameters.
  ConstellationMap() : ConstellationMap(Parameters{}) {}
  /// An empty map.
  explicit ConstellationMap(const Parameters& parameters);

  /// False (and nothing is changed) if `id` is already there or the position cannot be stored.
  bool insert(LandmarkId id, const Eigen::Vector2d& position_m);
  /// False if `id` is not there.
  bool remove(LandmarkId id);
  /// False if `id` is not there or the position cannot be stored.
  bool move(LandmarkId id, const Eigen::Vector2d& position_m);
  /// The same, but the landmark's triangles stay as they are until settle(): for many repeated
  /// moves without a search between them. O(log(shifted landmarks)), a hundredth of the cost of
  /// move().
  bool shift(LandmarkId id, const Eigen::Vector2d& position_m);
  /// Updates the triangles of all shifted landmarks; the result equals that of move() in place of
  /// shift(). Cost: one move() for each shifted landmark.
  void settle();
  /// Whether no landmark was shifted since settle().
  bool is_settled() const { return shifted_.empty(); }

  /// Number of landmarks.
  std::size_t size() const { return slots_.size(); }
  /// Whether the landmark is in the map.
  bool contains(LandmarkId id) const { return slots_.find(id) != kNoSlot; }
  /// Position of the landmark [m]; none if it is not in the map.
  std::optional<Eigen::Vector2d> position(LandmarkId id) const;

  /// The landmark closest to `point_m` within `radius_m`; of equally close ones the smaller id.
  std::optional<NearestLandmark> nearest(const Eigen::Vector2d& point_m, double radius_m) const;
  /// Calls f(id, position [m], distance [m]) for each landmark within `radius_m`, in no defined
  /// order: sort before any output.
  template <class F>
  void for_each_within(const Eigen::Vector2d& point_m, double radius_m, F&& f) const {
    if (!PointGrid::representable(point_m)) return;
    grid().for_each_within(point_m.x(), point_m.y(), radius_m, [&](Slot slot, double squared) {
      f(id_of(slot), grid().position(slot), std::sqrt(squared));
    });
  }
  /// Ids of the landmarks in the disc, in ascending order.
  std::vector<LandmarkId> near(const Disc& disc) const;

  /// The pose from which `points` were observed, with no prior; if `where` is given, only poses
  /// whose position lies in it are considered.
  ///
  /// Triangles among nearest neighbours of the observation are looked up by side lengths, those
  /// with the fewest candidates first; each similar triangle of the map is a hypothesis. It is
  /// tested on the points around it one by one (Wald's sequential test), then refined on all
  /// points. A pose is accepted if chance does not explain it and no different pose is nearly as
  /// good. Precondition: is_settled().
  Localisation localise(std::span<const ObservedPoint> points,
                        const LocaliseParameters& parameters = {},
                        const std::optional<Disc>& where = std::nullopt) const;

  /// Every triangle as ascending ids, sorted: for comparisons.
  std::vector<std::array<LandmarkId, 3>> triangles() const;
  /// Number of triangles in the index.
  std::size_t triangle_count() const { return net_.triangles().size(); }
  /// Memory held [bytes].
  std::size_t bytes() const;

  /// The landmarks by slot, for the search in localise.cpp.
  const PointGrid& grid() const { return grid_; }
  /// The triangles by side lengths, for the search in localise.cpp. Vertices are slots.
  const TriangleIndex& triangle_index() const { return net_.triangles(); }
  /// Isolated landmarks in dense areas, one set for each least distance to others.
  std::span<const Hermits> hermits() const { return hermits_; }
  /// Id of the landmark in a slot. Precondition: the slot is in use.
  LandmarkId id_of(Slot slot) const { return net_.id_of(slot); }

 private:
  void settle(Slot slot);

  PointGrid grid_;
  TriangleNet net_;  ///< Positions at the last settle().
  std::set<Slot> shifted_;
  std::vector<Hermits> hermits_;
  IndexTable slots_;  // id -> slot
  std::vector<Slot> free_slots_;
};

}  // namespace understory::constellation
