// A pose of the mapper's graph.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "common/factor_graph/plane/smoother.hpp"
#include "common/model/landmarks.hpp"

namespace understory::geoslam_mapper::smoothing {

/// A motion measured between two nodes, by its number in the smoother.
struct MotionRef {
  bool is_biased = false;  ///< The gyro's bias is one of its variables.
  std::uint32_t number = 0;

  bool operator==(const MotionRef&) const = default;
  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.is_biased, s.number);
  }
};

/// The centre of one keyframe, or of several that were folded together. Memory for observations and
/// motions is allocated only if there are any: all but some tens of the nodes of a long drive have
/// none and take 32 bytes each.
class Node {
 public:
  /// The factor in the graph of each observed landmark.
  using Observations = std::map<model::LandmarkId, factor_graph::plane::ObservationId>;
  /// Motions that begin or end at the node.
  using Motions = std::vector<MotionRef>;

  factor_graph::plane::PoseId centre{};
  bool is_stationary = false;  ///< Of the vehicle, during the keyframe.
  bool is_condensed = false;   ///< The node replaces the nodes of a stretch of the path.
  double along_m = 0.0;        ///< Path length of the vehicle up to here.
  double keyframes =
      1.0;  ///< Number of keyframes whose observations it has, including those of removed nodes.

  Node() = default;
  /// A node without observations.
  Node(factor_graph::plane::PoseId its_centre, bool stationary, double its_along_m)
      : centre(its_centre), is_stationary(stationary), along_m(its_along_m) {}
  Node(Node&&) noexcept = default;
  Node& operator=(Node&&) noexcept = default;
  Node(const Node& other) { *this = other; }
  Node& operator=(const Node& other) {
    if (this == &other) return *this;
    centre = other.centre;
    is_stationary = other.is_stationary;
    is_condensed = other.is_condensed;
    along_m = other.along_m;
    keyframes = other.keyframes;
    solved_ = other.solved_ ? std::make_unique<Solved>(*other.solved_) : nullptr;
    return *this;
  }
  ~Node() = default;

  /// Its observations.
  const Observations& observations() const { return solved().observations; }
  /// Its motions.
  const Motions& motions() const { return solved().motions; }
  /// Mutable observations. Their memory stays allocated until give_room_back().
  Observations& edit_observations() { return make().observations; }
  /// Likewise.
  Motions& edit_motions() { return make().motions; }
  /// Frees the memory of empty containers.
  void give_room_back() {
    if (observations().empty() && motions().empty()) solved_.reset();
  }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    if constexpr (Archive::kReads) {
      Solved solved;
      a(s.centre, solved.observations, solved.motions, s.is_stationary, s.along_m, s.keyframes,
        s.is_condensed);
      s.solved_ = std::make_unique<Solved>(std::move(solved));
      s.give_room_back();
    } else {
      a(s.centre, s.observations(), s.motions(), s.is_stationary, s.along_m, s.keyframes,
        s.is_condensed);
    }
  }

 private:
  /// Its factors in the solved graph.
  struct Solved {
    Observations observations;
    Motions motions;
  };
  const Solved& solved() const {
    static const Solved kNone;
    return solved_ ? *solved_ : kNone;
  }
  Solved& make() {
    if (!solved_) solved_ = std::make_unique<Solved>();
    return *solved_;
  }

  std::unique_ptr<Solved> solved_;
};

}  // namespace understory::geoslam_mapper::smoothing
