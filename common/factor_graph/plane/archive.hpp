// The members of a plane graph in a saved state.
#pragma once

#include "common/factor_graph/plane/graph.hpp"
#include "common/state/archive.hpp"

namespace understory::factor_graph::plane {

/// Each function below lists the members of one type, for state::Writer and state::Reader.
template <class Archive, class Self>
requires state::Is<Self, PosePrior>
void archive(Archive& a, Self& s) { a(s.pose, s.mean, s.information); }
template <class Archive, class Self>
requires state::Is<Self, RelativePose>
void archive(Archive& a, Self& s) { a(s.a, s.b, s.a_T_b, s.information); }
template <class Archive, class Self>
requires state::Is<Self, BiasedRelativePose>
void archive(Archive& a, Self& s) { a(s.motion, s.bias, s.seconds); }
template <class Archive, class Self>
requires state::Is<Self, ScalarPrior>
void archive(Archive& a, Self& s) { a(s.scalar, s.mean, s.information); }
template <class Archive, class Self>
requires state::Is<Self, ScalarStep>
void archive(Archive& a, Self& s) { a(s.a, s.b, s.information); }
template <class Archive, class Self>
requires state::Is<Self, PointPrior>
void archive(Archive& a, Self& s) { a(s.point, s.mean, s.information); }
template <class Archive, class Self>
requires state::Is<Self, PointObservation>
void archive(Archive& a, Self& s) { a(s.pose, s.point, s.position, s.information); }

/// The whole graph: values at the present estimates, and factors.
template <class Archive, class Self>
requires state::Is<Self, Graph>
void archive(Archive& a, Self& s) {
  a(s.poses, s.points, s.scalars, s.pose_priors, s.relative_poses, s.point_priors, s.observations,
    s.biased_relative_poses, s.scalar_priors, s.scalar_steps);
}

}  // namespace understory::factor_graph::plane
