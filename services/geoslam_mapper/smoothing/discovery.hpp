// Landmarks that are not in the map yet.
#pragma once

#include <span>
#include <vector>

#include "common/model/archive.hpp"
#include "common/model/keyframe.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Collects landmarks that keyframes observed and the map does not contain, until they are
/// confirmed (replaces GeoSLAM §4.3.4, algorithm 5).
class Discovery {
 public:
  /// An empty list of candidates.
  explicit Discovery(const SmoothingMapperParameters& parameters) : parameters_(parameters) {}

  /// Every landmark of the keyframe without an association becomes a candidate, or a further
  /// observation of one. A candidate with enough observations enters the map with all of them, so
  /// no measurement is lost. `keyframe` is in the frame of `node` and already in the trajectory.
  /// Returns the associations with the new landmarks.
  std::vector<model::Association> update(const model::Keyframe& keyframe, NodeIndex node,
                                         std::span<const model::Association> known, GlobalMap& map);

  /// A node leaves the graph: its observations of candidates move to the node that replaces it.
  void hand_over(const Retirement& retirement);

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.candidates_);
  }

 private:
  /// Observed, but not often enough to be confirmed.
  struct Candidate {
    struct Observation {
      NodeIndex node = 0;
      model::KeyframeLandmark landmark;  ///< In the node's centre frame.

      template <class Archive, class Self>
      static void archive(Archive& a, Self& s) {
        a(s.node, s.landmark);
      }
    };
    Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< Frame `map`.
    std::vector<Observation> observations;
    std::uint32_t observation_count = 0;  ///< Number of scans that detected it.
    std::uint32_t times_in_view = 0;      ///< Scans since the first with the candidate in view.
    std::uint32_t first_keyframe = 0;     ///< Number of accepted keyframes at its first one.
    model::LandmarkKind kind = model::LandmarkKind::kTrunk;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.position_m, s.observations, s.observation_count, s.times_in_view, s.first_keyframe,
        s.kind);
    }
  };

  void follow(const model::Keyframe& keyframe, const geometry::SE2& centre_T_map,
              const PoseGraph& graph);
  Candidate* matching(const Eigen::Vector2d& position_m, const model::KeyframeLandmark& observed);
  bool is_confirmed(const Candidate& candidate) const;
  model::LandmarkId promote(const Candidate& candidate, GlobalMap& map) const;
  void forget_stale(std::uint32_t keyframes);

  SmoothingMapperParameters parameters_;
  std::vector<Candidate> candidates_;
};

}  // namespace understory::geoslam_mapper::smoothing
