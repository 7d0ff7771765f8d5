// Estimate and covariance of the filter: the vehicle and the landmarks near it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/landmarks.hpp"
#include "common/model/odometry.hpp"
#include "common/model/tracked.hpp"
#include "services/ekf/subtract_product.hpp"

namespace understory::ekf {

/// Definition of the state's error. With S = rotation by 90 degrees to the left, heading error t
/// and an error d, in the axes of the map, of any point or velocity x:
///  * right invariant (Barrau & Bonnabel 2017): d - t S x. A rotation of the whole map is then an
///    error of the heading alone, whatever the estimates are, so linearisation at changing
///    estimates creates no false information about the heading.
///  * plain: d, as in textbooks. The heading becomes overconfident: no measurement observes it.
///  * first estimate (Huang, Mourikis & Roumeliotis 2010): d, with Jacobians at the first
///    estimates.
enum class ErrorForm : std::uint8_t { kRightInvariant, kFirstEstimate, kPlain };

// Order of the state: heading, position, velocity (both in the axes of the map), bias, error of the
// level (roll, pitch, in the axes of the vehicle), landmarks.

/// Row of the heading [rad].
inline constexpr int kHeading = 0;
/// First of two rows of the position [m].
inline constexpr int kPosition = 1;
/// First of two rows of the velocity [m/s].
inline constexpr int kVelocity = 3;
/// First of three rows of the inertial bias (gyro z [rad/s], accelerometer x, y [m/s^2]).
inline constexpr int kBias = 5;
/// First of two rows of the level's error (roll, pitch) [rad].
inline constexpr int kLevel = 8;
/// Rows of the vehicle; landmarks follow, two rows each.
inline constexpr int kVehicle = 10;

/// A matrix over the vehicle's rows.
using VehicleMatrix = Eigen::Matrix<double, kVehicle, kVehicle>;

/// A landmark of the state and its history. Its covariance is in FilterState.
struct MapLandmark {
  /// Its first track; 0 = a mark on the ground (ground_marks.hpp).
  model::TrackId id = 0;
  Eigen::Vector2d position = Eigen::Vector2d::Zero();        ///< From the anchor [m].
  Eigen::Vector2d first_position = Eigen::Vector2d::Zero();  ///< `position` when it was added [m].
  double radius_m = 0.0;                                     ///< Mean radius; 0 = unknown.
  model::LandmarkKind kind = model::LandmarkKind::kTrunk;
  std::uint32_t observation_count = 0;
  std::uint32_t missed = 0;     ///< Consecutive scans with it in view that did not observe it.
  std::uint32_t refused = 0;    ///< Consecutive scans in which its gate refused it.
  std::uint64_t last_scan = 0;  ///< Number of the latest scan that observed it.
  /// Effective number of observations with the same correlated error, the latest one included.
  double views = 0.0;
  double observed_at_m = 0.0;         ///< Distance driven at the latest observation.
  double observed_variance_m2 = 0.0;  ///< Variance of the latest observation, per axis.
  double height_m = 0.0;  ///< Above the vehicle's origin; 0 = without effect of the level.

  /// Whether it is a mark on the ground, not a landmark of the map.
  bool is_ground_mark() const { return id == 0; }
  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.id, self.position, self.first_position, self.radius_m, self.kind, self.observation_count,
      self.missed, self.refused, self.last_scan, self.views, self.observed_at_m,
      self.observed_variance_m2, self.height_m);
  }
};

/// Writes or reads the lower triangle of the first `size` rows of a square matrix, column by
/// column: half the bytes of the whole. The rest of the matrix stays unchanged.
template <class Archive, class Matrix>
void archive_lower_triangle(Archive& a, Matrix& matrix, int size) {
  for (int c = 0; c < size; ++c) {
    for (int r = c; r < size; ++r) a(matrix(r, c));
  }
}

/// Estimate and covariance. Positions are relative to the anchor, a point of the map that follows
/// the vehicle, so that the covariance of right invariant errors stays well conditioned far from
/// the origin. Memory is allocated once, for `max_landmarks`.
class FilterState {
 public:
  /// An estimate of zero with a covariance of zero and no landmarks.
  FilterState(ErrorForm form, int max_landmarks);

  /// Definition of its errors.
  ErrorForm form() const { return form_; }
  /// Rows in use.
  int size() const { return kVehicle + 2 * static_cast<int>(landmarks_.size()); }
  /// Capacity.
  int max_landmarks() const { return max_landmarks_; }
  /// First row of a landmark.
  static int row(std::size_t landmark) { return kVehicle + 2 * static_cast<int>(landmark); }

  double heading = 0.0;                                ///< [rad]
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  ///< From the anchor [m].
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  ///< Axes of the map [m/s].
  model::InertialBias bias = model::InertialBias::Zero();
  /// Error (roll, pitch) of the attitude that levels sweeps [rad]; see model::LevelError.
  Eigen::Vector2d level = Eigen::Vector2d::Zero();
  Eigen::Vector2d anchor_m = Eigen::Vector2d::Zero();  ///< Frame `ekf_map`.
  /// Position as predicted, before any measurement [m]: for first-estimate Jacobians.
  Eigen::Vector2d first_position = Eigen::Vector2d::Zero();
  /// Likewise the velocity [m/s].
  Eigen::Vector2d first_velocity = Eigen::Vector2d::Zero();

  /// In the order of their rows; ground marks included.
  const std::vector<MapLandmark>& landmarks() const { return landmarks_; }
  /// Landmark `i`, for changes of its history.
  MapLandmark& landmark(std::size_t i) { return landmarks_[i]; }

  /// Factor of the true heading error in the error of a point x: S x, or zero (see ErrorForm).
  Eigen::Vector2d lever(const Eigen::Vector2d& x) const;

  /// The rows in use. Only the lower triangle is valid.
  auto covariance() { return covariance_.topLeftCorner(size(), size()); }
  /// The same for reading.
  auto covariance() const { return covariance_.topLeftCorner(size(), size()); }
  /// Element (i, j) of the symmetric matrix.
  double covariance(int i, int j) const { return i >= j ? covariance_(i, j) : covariance_(j, i); }
  /// Block at (i, j) of the symmetric matrix.
  template <int Rows, int Cols>
  Eigen::Matrix<double, Rows, Cols> covariance_block(int i, int j) const {
    Eigen::Matrix<double, Rows, Cols> block;
    for (int c = 0; c < Cols; ++c) {
      for (int r = 0; r < Rows; ++r) block(r, c) = covariance(i + r, j + c);
    }
    return block;
  }
  /// The whole covariance, padded for the kernel.
  Panel covariance_panel() { return {covariance_.data(), covariance_.outerStride()}; }
  /// Column `j` of the symmetric matrix into `out` (size() rows).
  template <typename Column>
  void copy_column(int j, Column&& out) const {
    const int n = size();
    for (int i = 0; i < j; ++i) out(i) = covariance_(j, i);
    out.segment(j, n - j) = covariance_.col(j).segment(j, n - j);
  }

  /// Moves the estimate by an error `delta` of the form in use (size() numbers).
  void retract(const Eigen::Ref<const Eigen::VectorXd>& delta);

  /// Adds a landmark observed at `in_vehicle` [m] with covariance `variance` [m^2] (axes of the
  /// vehicle), `height_m` above the vehicle's origin. O(size). Precondition: fewer than
  /// max_landmarks().
  void add_landmark(const MapLandmark& landmark, const Eigen::Vector2d& in_vehicle,
                    const Eigen::Matrix2d& variance, double height_m = 0.0);
  /// Removes a landmark; the others keep their estimates and covariances (marginalisation).
  /// O(size^2).
  void remove_landmark(std::size_t i);
  /// Removes all landmarks.
  void clear_landmarks() { landmarks_.clear(); }
  /// Moves the anchor to the vehicle if they are more than 150 m apart. Estimates in `ekf_map` and
  /// their covariances stay the same.
  void follow_with_anchor();

  /// Members of a saved state; see common/state. The capacity is configuration. Throws
  /// std::invalid_argument if the state is of another error form or exceeds the capacity.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    ErrorForm form = self.form_;
    a(form, self.heading, self.position, self.velocity, self.bias, self.level, self.anchor_m,
      self.first_position, self.first_velocity, self.landmarks_);
    if constexpr (Archive::kReads) {
      if (form != self.form_) throw std::invalid_argument("state: of another error_form");
      if (self.landmarks_.size() > static_cast<std::size_t>(self.max_landmarks_)) {
        throw std::invalid_argument("state: more landmarks than map.max_landmarks");
      }
    }
    archive_lower_triangle(a, self.covariance_, self.size());
  }

 private:
  ErrorForm form_;
  int max_landmarks_;
  std::vector<MapLandmark> landmarks_;
  Eigen::MatrixXd covariance_;  ///< Of full capacity; the upper left corner is in use.
};

/// The matrix S that rotates by 90 degrees to the left.
Eigen::Matrix2d quarter_turn();
/// Displacement by a level error of (roll, pitch) at 1 m above the vehicle's origin [m/rad].
Eigen::Matrix2d level_displacement();
/// Rotation by `heading` [rad].
Eigen::Matrix2d rotation_of(double heading);

}  // namespace understory::ekf
