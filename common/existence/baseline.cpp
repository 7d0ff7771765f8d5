#include "common/existence/baseline.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace understory::existence {
namespace {

double checked_distance_m(const Eigen::Vector3f& from_point_m) {
  const double distance_m = from_point_m.cast<double>().norm();
  if (!(distance_m > 0.0 && distance_m < 1e6))
    throw std::invalid_argument("existence: a look without a finite distance");
  return distance_m;
}

}  // namespace

BaselinePoint::BaselinePoint(const BaselineParameters& parameters)
    : parameters_(parameters), probability_(parameters.prior) {
  visible_.fill(parameters.visibility);
  reach_m_.fill(parameters.range_m);
}

void BaselinePoint::hit(const Eigen::Vector3f& from_point_m) {
  const double distance_m = checked_distance_m(from_point_m);
  const FacePoint at = locate_on_icosahedron(from_point_m);
  probability_ = 1.0;

  double& visible = visible_[static_cast<std::size_t>(at.face)];
  const double seen = visible * parameters_.recall;
  visible = seen / (seen + (1.0 - visible) * parameters_.false_rate);
  const auto nearest = std::max_element(at.weights.begin(), at.weights.end()) - at.weights.begin();
  double& reach_m = reach_m_[at.vertices[static_cast<std::size_t>(nearest)]];
  reach_m = std::max(reach_m, distance_m);
}

void BaselinePoint::miss(const Eigen::Vector3f& from_point_m) {
  const double distance_m = checked_distance_m(from_point_m);
  const FacePoint at = locate_on_icosahedron(from_point_m);
  double reach_m = 0.0;
  for (std::size_t i = 0; i < 3; ++i)
    reach_m += static_cast<double>(at.weights[i]) * reach_m_[at.vertices[i]];
  if (distance_m > reach_m) return;  // not expected in view

  double& visible = visible_[static_cast<std::size_t>(at.face)];
  const double seen = visible * parameters_.recall;
  probability_ = probability_ * (1.0 - seen) / (1.0 - probability_ * seen);
  visible = visible * (1.0 - parameters_.recall) / (1.0 - seen);
  if (visible < parameters_.face_threshold) draw_in(at.face);
}

void BaselinePoint::draw_in(int face) {
  const IcosahedronFace& at = kIcosahedron[static_cast<std::size_t>(face)];
  for (const auto vertex : at.vertices) reach_m_[vertex] *= 0.5;
  double sum = 0.0;
  for (const auto neighbour : at.neighbours) sum += visible_[neighbour];
  visible_[static_cast<std::size_t>(face)] = sum / 3.0;
}

}  // namespace understory::existence
