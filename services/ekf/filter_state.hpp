// Estimate and covariance of the filter: the vehicle and the landmarks near by.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/landmarks.hpp"
#include "common/model/odometry.hpp"
#include "common/model/tracked.hpp"
#include "services/ekf/subtract_product.hpp"

namespace understory::ekf {

/// How an error of the state is measured. With S = turned_left, heading error t and an error d in
/// the axes of the map of any point or velocity x:
///  * right invariant (Barrau & Bonnabel 2017): d - t S x. A turn of the whole map is then an error
///    of the heading alone, whatever the estimates are, so linearising at changing estimates
///    invents no knowledge of the heading.
///  * plain: d. As in every textbook; grows sure of a heading that nothing tells.
///  * first estimate (Huang, Mourikis & Roumeliotis 2010): d, with Jacobians taken at the first
///    estimates.
enum class ErrorForm : std::uint8_t { kRightInvariant, kFirstEstimate, kPlain };

/// Order of the state: heading, position, velocity (both in the axes of the map), bias, error of
/// the level (roll, pitch, in the axes of the vehicle), landmarks.
inline constexpr int kHeading = 0;
inline constexpr int kPosition = 1;
inline constexpr int kVelocity = 3;
inline constexpr int kBias = 5;
inline constexpr int kLevel = 8;
inline constexpr int kVehicle = 10;

using VehicleMatrix = Eigen::Matrix<double, kVehicle, kVehicle>;

struct MapLandmark {
  model::TrackId id =
      0;  ///< Of the track that it began with; 0 = a mark on the ground (ground_marks.hpp).
  Eigen::Vector2d position = Eigen::Vector2d::Zero();        ///< From the anchor [m].
  Eigen::Vector2d first_position = Eigen::Vector2d::Zero();  ///< When it was added.
  double radius_m = 0.0;
  model::LandmarkKind kind = model::LandmarkKind::kTrunk;
  std::uint32_t observation_count = 0;
  std::uint32_t missed = 0;       ///< Scans in a row that should have shown it.
  std::uint32_t refused = 0;      ///< Scans in a row in which its gate refused it.
  std::uint64_t last_scan = 0;    ///< Number of the scan that saw it last.
  double views = 0.0;             ///< Sightings of it from about the same place, the last included.
  double seen_at_m = 0.0;         ///< Way at the last of them.
  double seen_variance_m2 = 0.0;  ///< Of the last of them, per axis.
  double height_m = 0.0;          ///< Above the vehicle's origin; 0 = no level took part.

  bool is_ground_mark() const { return id == 0; }
};

/// Positions count from the anchor, a place in the map that follows the vehicle, so that the
/// covariance of right invariant errors stays well conditioned far out.
class FilterState {
 public:
  FilterState(ErrorForm form, int max_landmarks);

  ErrorForm form() const { return form_; }
  int size() const { return kVehicle + 2 * static_cast<int>(landmarks_.size()); }
  int max_landmarks() const { return max_landmarks_; }
  static int row(std::size_t landmark) { return kVehicle + 2 * static_cast<int>(landmark); }

  double heading = 0.0;
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();
  model::InertialBias bias = model::InertialBias::Zero();
  /// By how much the attitude that levels sweeps is off [rad] (LevelError).
  Eigen::Vector2d level = Eigen::Vector2d::Zero();
  Eigen::Vector2d anchor_m = Eigen::Vector2d::Zero();  ///< In `ekf_map`.
  /// Position and velocity as predicted, before any measurement: for first-estimate Jacobians.
  Eigen::Vector2d first_position = Eigen::Vector2d::Zero();
  Eigen::Vector2d first_velocity = Eigen::Vector2d::Zero();

  const std::vector<MapLandmark>& landmarks() const { return landmarks_; }
  MapLandmark& landmark(std::size_t i) { return landmarks_[i]; }

  /// The place of the true heading error in the error of a point x: S x, or zero (see ErrorForm).
  Eigen::Vector2d lever(const Eigen::Vector2d& x) const;

  /// The lower triangle alone is kept.
  auto covariance() { return covariance_.topLeftCorner(size(), size()); }
  auto covariance() const { return covariance_.topLeftCorner(size(), size()); }
  double covariance(int i, int j) const { return i >= j ? covariance_(i, j) : covariance_(j, i); }
  template <int Rows, int Cols>
  Eigen::Matrix<double, Rows, Cols> covariance_block(int i, int j) const {
    Eigen::Matrix<double, Rows, Cols> block;
    for (int c = 0; c < Cols; ++c) {
      for (int r = 0; r < Rows; ++r) block(r, c) = covariance(i + r, j + c);
    }
    return block;
  }
  /// The whole covariance, padded as the kernel needs it.
  Panel covariance_panel() { return {covariance_.data(), covariance_.outerStride()}; }
  /// Column `j` of the whole covariance.
  template <typename Column>
  void copy_column(int j, Column&& out) const {
    const int n = size();
    for (int i = 0; i < j; ++i) out(i) = covariance_(j, i);
    out.segment(j, n - j) = covariance_.col(j).segment(j, n - j);
  }

  /// Moves the estimate by an error `delta` of the form in use (size() numbers).
  void retract(const Eigen::Ref<const Eigen::VectorXd>& delta);

  /// Adds a landmark seen at `in_vehicle` with noise `variance` (axes of the vehicle), `height_m`
  /// above the vehicle's origin. Precondition: fewer than max_landmarks().
  void add_landmark(const MapLandmark& landmark, const Eigen::Vector2d& in_vehicle,
                    const Eigen::Matrix2d& variance, double height_m = 0.0);
  /// Makes a landmark less certain, alone.
  void loosen_landmark(std::size_t i, double variance_m2);
  /// Takes a landmark out: the others keep what they know (marginalisation).
  void remove_landmark(std::size_t i);
  void clear_landmarks() { landmarks_.clear(); }

  geometry::SE2 pose() const { return {position + anchor_m, heading}; }
  /// Tangent order, right perturbation.
  Eigen::Matrix3d pose_covariance() const;
  /// Of (velocity, bias), velocity in the vehicle's axes.
  Eigen::Matrix<double, 5, 5> velocity_covariance() const;
  /// Axes of the map.
  Eigen::Matrix2d landmark_covariance(std::size_t i) const;
  /// Moves the anchor to the vehicle when that is far from it.
  void follow_with_anchor();
  /// All finite and no variance negative.
  bool is_sound() const;
  /// Sets the covariance of the pose (right perturbation) and forgets what it shares with the rest.
  void set_pose_covariance(const Eigen::Matrix3d& covariance);

  /// For saving and loading.
  void resize_landmarks(const std::vector<MapLandmark>& landmarks) { landmarks_ = landmarks; }

 private:
  ErrorForm form_;
  int max_landmarks_;
  std::vector<MapLandmark> landmarks_;
  Eigen::MatrixXd covariance_;  ///< Of full capacity; the upper left corner is in use.
};

/// Turns by 90 degrees to the left.
Eigen::Matrix2d quarter_turn();
/// How a level off by (roll, pitch) displaces what is 1 m above the vehicle's origin.
Eigen::Matrix2d level_displacement();
Eigen::Matrix2d rotation_of(double heading);

}  // namespace understory::ekf
