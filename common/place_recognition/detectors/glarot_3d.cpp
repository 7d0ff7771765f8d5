#include "common/place_recognition/detectors/glarot_3d.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace understory::place_recognition::detectors {
namespace {

/// Axes of the grid of each pair of opposite faces: x, y, z.
constexpr std::array<std::array<int, 2>, 3> kGridAxes{{{1, 2}, {2, 0}, {0, 1}}};

/// All signed permutation matrices without reflection.
std::vector<Eigen::Matrix3d> cube_rotations() {
  std::vector<Eigen::Matrix3d> found;
  std::array<int, 3> axis{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
      for (int row = 0; row < 3; ++row)
        matrix(row, axis[static_cast<std::size_t>(row)]) = ((signs >> row) & 1) != 0 ? -1.0 : 1.0;
      if (matrix.determinant() > 0.0) found.push_back(matrix);
    }
  } while (std::next_permutation(axis.begin(), axis.end()));
  return found;
}

std::size_t grid_index(double tangent, std::size_t grid) {
  const double place =
      static_cast<double>(grid) * (2.0 / std::numbers::pi * std::atan(tangent) + 0.5);
  return std::min(grid - 1, static_cast<std::size_t>(std::max(0.0, place)));
}

}  // namespace

const std::vector<Eigen::Matrix3d>& Glarot3dSignature::rotations() {
  static const std::vector<Eigen::Matrix3d> all = cube_rotations();
  return all;
}

Glarot3dSignature::Glarot3dSignature(const Glarot3dParameters& parameters, double place_sigma_m)
    : parameters_(parameters), place_sigma_m_(place_sigma_m) {
  for (const Eigen::Matrix3d& rotation : rotations()) {
    std::vector<std::uint32_t> to(cells());
    for (std::size_t cell = 0; cell < to.size(); ++cell)
      to[cell] = static_cast<std::uint32_t>(cell_of(rotation * middle_of(cell)));
    rotated_.push_back(std::move(to));
  }
}

std::size_t Glarot3dSignature::cell_of(const Eigen::Vector3d& direction) const {
  Eigen::Index axis = 0;
  const double largest = direction.cwiseAbs().maxCoeff(&axis);
  const std::array<int, 2>& grid_axis = kGridAxes[static_cast<std::size_t>(axis)];
  const std::size_t face = 2 * static_cast<std::size_t>(axis) + (direction[axis] < 0.0 ? 1 : 0);
  const std::size_t u = grid_index(direction[grid_axis[0]] / largest, parameters_.grid);
  const std::size_t v = grid_index(direction[grid_axis[1]] / largest, parameters_.grid);
  return (face * parameters_.grid + u) * parameters_.grid + v;
}

/// The direction through the centre of a cell.
Eigen::Vector3d Glarot3dSignature::middle_of(std::size_t cell) const {
  const auto tangent = [&](std::size_t index) {
    const double place =
        (static_cast<double>(index) + 0.5) / static_cast<double>(parameters_.grid) - 0.5;
    return std::tan(0.5 * std::numbers::pi * place);
  };
  const std::size_t v = cell % parameters_.grid;
  const std::size_t u = cell / parameters_.grid % parameters_.grid;
  const std::size_t face = cell / (parameters_.grid * parameters_.grid);

  const std::array<int, 2>& grid_axis = kGridAxes[face / 2];
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  direction[static_cast<Eigen::Index>(face / 2)] = face % 2 == 0 ? 1.0 : -1.0;
  direction[grid_axis[0]] = tangent(u);
  direction[grid_axis[1]] = tangent(v);
  return direction;
}

bool Glarot3dSignature::describe(const PlaceFrame& frame, std::span<float> row) const {
  const std::vector<PlaceLandmark> landmarks = landmarks_of(frame);
  std::vector<double> count(length(), 0.0);
  double pairs = 0.0;
  for (const PlaceLandmark& from : landmarks) {
    for (const PlaceLandmark& to : landmarks) {
      const Eigen::Vector3d along = to.position_m - from.position_m;
      if (&from == &to || along.isZero(0.0)) continue;
      const double range = along.norm() / parameters_.range_step_m;
      if (range >= static_cast<double>(parameters_.range_bins)) continue;
      count[cell_of(along) * parameters_.range_bins + static_cast<std::size_t>(range)] += 1.0;
      pairs += 1.0;
    }
  }
  if (pairs == 0.0) return false;

  for (std::size_t i = 0; i < count.size(); ++i) row[i] = static_cast<float>(count[i] / pairs);
  return true;
}

RowDistance Glarot3dSignature::compare(std::span<const float> query,
                                       std::span<const float> frame) const {
  const auto bins = static_cast<Eigen::Index>(parameters_.range_bins);
  RowDistance best{std::numeric_limits<double>::infinity(), 0};
  for (std::size_t rotation = 0; rotation < rotated_.size(); ++rotation) {
    double distance = 0.0;
    for (std::size_t cell = 0; cell < cells(); ++cell) {
      const Eigen::Map<const Eigen::ArrayXf> from(query.data() + cell * parameters_.range_bins,
                                                  bins);
      const Eigen::Map<const Eigen::ArrayXf> to(
          frame.data() + rotated_[rotation][cell] * parameters_.range_bins, bins);
      distance += static_cast<double>((from - to).abs().sum());
      if (distance >= best.distance) break;
    }
    if (distance < best.distance) best = {distance, rotation};
  }
  return best;
}

std::vector<geometry::SE2WithCovariance> Glarot3dSignature::guesses(std::size_t rotation) const {
  const Eigen::Matrix3d& frame_R_query = rotations()[rotation];
  if (frame_R_query(2, 2) < 0.5) return {};
  const double heading_rad = std::atan2(frame_R_query(1, 0), frame_R_query(0, 0));
  return {heading_guess({0.0, 0.0, heading_rad}, place_sigma_m_, std::numbers::pi / 8.0)};
}

}  // namespace understory::place_recognition::detectors
