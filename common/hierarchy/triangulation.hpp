// Delaunay triangulation of landmarks that changes in place.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

namespace understory::hierarchy {

/// Result of a change to a landmark. All but kDone leave the structure unchanged.
enum class ChangeStatus : std::uint8_t {
  kDone = 0,
  kIdInUse = 1,     ///< Insertion of an existing id.
  kUnknownId = 2,   ///< Removal or move of an unknown id.
  kCoincident = 3,  ///< Another landmark has exactly this position.
  kNotFinite = 4,   ///< A coordinate is infinite or not a number.
};

/// "None": no triangle across this edge (hull), no polygon, no landmark.
inline constexpr std::uint32_t kNone = 0xffffffffU;

/// A Delaunay triangle, counter-clockwise. Edge i lies opposite vertex i.
struct Triangle {
  /// The longest edge; of equally long ones the one with the larger landmark ids, so that both
  /// triangles of an edge rank it equally.
  std::uint32_t longest_edge = 0;
  std::array<std::uint32_t, 3> vertices{kNone, kNone, kNone};  ///< Landmark slots.
  /// Triangle across edge i; kNone = hull.
  std::array<std::uint32_t, 3> neighbours{kNone, kNone, kNone};
};

/// The triangles affected by one change, for users with data per triangle.
struct TriangulationChange {
  std::vector<std::uint32_t> removed;  ///< Removed; their indices may be reused in `made`.
  std::vector<std::uint32_t> made;     ///< New, or changed in shape by a moved vertex.
  std::vector<std::uint32_t> rim;      ///< Unchanged, but with another neighbour across an edge.

  /// Empties the three lists and keeps their memory.
  void clear();
  /// Puts an earlier change before this one; `triangles`: those after both. Triangles made by the
  /// first change and removed by the second are in `removed` only.
  void prepend(const TriangulationChange& earlier, std::span<const Triangle> triangles);
};

/// Delaunay triangulation with insertion, removal and motion of single landmarks, each in time that
/// does not grow with the map. The result depends on the set of landmarks alone, not on the order
/// of changes: ties between cocircular points are broken by symbolic perturbation in the
/// lexicographic order of their coordinates (Devillers & Teillaud 2011). Coordinates are metres in
/// any one frame.
///
/// Landmarks and triangles are stored in flat arrays; their indices ("slots") are reused after a
/// removal, ids are not.
class Triangulation {
 public:
  /// An empty triangulation.
  Triangulation();
  ~Triangulation();
  /// The moved-from object permits assignment and destruction only.
  Triangulation(Triangulation&&) noexcept;
  Triangulation& operator=(Triangulation&&) noexcept;
  Triangulation(const Triangulation&) = delete;
  Triangulation& operator=(const Triangulation&) = delete;

  /// Adds a landmark and replaces `change` by the triangles touched. Refused (and nothing is
  /// changed): an id in use, a position taken, a position that is not finite.
  ChangeStatus insert(std::uint64_t id, const Eigen::Vector2d& position_m,
                      TriangulationChange& change);
  /// Removes a landmark and replaces `change` by the triangles touched. Refused: an unknown id.
  ChangeStatus remove(std::uint64_t id, TriangulationChange& change);
  /// Gives a landmark a new position and replaces `change` by the triangles touched. Refused (and
  /// nothing is changed): an unknown id, a position taken, a position that is not finite.
  ChangeStatus move(std::uint64_t id, const Eigen::Vector2d& position_m,
                    TriangulationChange& change);

  /// Number of landmarks.
  std::size_t landmark_count() const { return slot_of_id_.size(); }
  /// Number of triangles.
  std::size_t triangle_count() const { return triangles_.size() - free_triangles_.size(); }
  /// All triangles by index; a free one has vertices of kNone.
  std::span<const Triangle> triangles() const { return triangles_; }
  /// Whether the index is in use.
  bool is_triangle(std::uint32_t index) const { return triangles_[index].vertices[0] != kNone; }

  /// Slot of a landmark; none for an unknown id.
  std::optional<std::uint32_t> slot(std::uint64_t id) const;
  /// Id of the landmark in a slot in use.
  std::uint64_t id(std::uint32_t slot) const { return ids_[slot]; }
  /// Position [m] of the landmark in a slot in use.
  const Eigen::Vector2d& position(std::uint32_t slot) const { return positions_[slot]; }
  /// One past the largest slot in use.
  std::size_t slot_count() const { return ids_.size(); }
  /// Whether the slot is in use.
  bool is_landmark(std::uint32_t slot) const;

 private:
  struct Impl;
  friend struct Impl;

  std::uint32_t allocate_slot(std::uint64_t id, const Eigen::Vector2d& position_m);
  void release_slot(std::uint32_t slot);
  void find_longest_edge(Triangle& triangle) const;

  std::unique_ptr<Impl> impl_;
  std::vector<Triangle> triangles_;
  std::vector<std::uint32_t> free_triangles_;
  std::vector<std::uint64_t> ids_;
  std::vector<Eigen::Vector2d> positions_;
  std::vector<std::uint32_t> free_slots_;
  std::unordered_map<std::uint64_t, std::uint32_t> slot_of_id_;
};

/// Order along a space-filling curve, in which many insertions are fast.
std::vector<std::uint32_t> insertion_order(std::span<const Eigen::Vector2d> positions_m);

}  // namespace understory::hierarchy
