// Which landmarks are in the solved graph.
#pragma once

#include "services/geoslam_mapper/parameters.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Keeps the solved graph to the ground around the vehicle: of what lies further away only
/// condensed nodes and motions between them are in it.
class Dormancy {
 public:
  /// `parameters` gives `condense_m`: without condensed nodes no landmark is dormant.
  explicit Dormancy(const SmoothingMapperParameters& parameters)
      : is_on_(parameters.condense_m > 0.0) {}

  /// To be called after accepted keyframes. Looks around every few metres; costs the landmarks in
  /// the solved graph then, and what is changed. True where it changed something, which the next
  /// solution takes in.
  bool follow(const model::FieldOfView& field_of_view, NodeIndex newest, GlobalMap& map);

  /// To be called before a keyframe is placed: what lies around a place far from where the vehicle
  /// was seen last is awake then, so that its uncertainty is known.
  void prepare(const model::FieldOfView& field_of_view, const Eigen::Vector2d& expected_m,
               GlobalMap& map) const;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.looked_m_, self.here_m_);
  }

 private:
  bool is_on_;
  double looked_m_ = 0.0;  ///< Path of the vehicle when it looked around.
  Eigen::Vector2d here_m_ = Eigen::Vector2d::Zero();  ///< Where that was, frame `map`.
};

}  // namespace understory::geoslam_mapper::smoothing
