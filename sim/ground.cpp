#include "sim/ground.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <utility>

namespace understory::sim {
namespace {

constexpr double kTile = 256.0;
constexpr double kCell = 0.5;
constexpr int kCells = 512;     // a power of two: indices wrap by masking
constexpr int kBlockCells = 8;  // 4 m
constexpr int kBlocks = kCells / kBlockCells;
constexpr double kLeastStep = 0.25;  ///< [m]

std::size_t node(int column, int row) {
  return static_cast<std::size_t>(row & (kCells - 1)) * kCells + (column & (kCells - 1));
}

/// Distance along the ray to the border of the block of `position` (in cells, positive).
double to_border(double position, double per_metre, double inverse) {
  if (per_metre == 0.0) return std::numeric_limits<double>::infinity();
  const int low = static_cast<int>(position) & ~(kBlockCells - 1);
  return ((per_metre > 0.0 ? low + kBlockCells : low) - position) * inverse;
}

}  // namespace

Ground::Ground() { fill_table(); }

Ground::Ground(std::vector<Wave> waves) : waves_(std::move(waves)) { fill_table(); }

Ground::Ground(const GroundParameters& parameters, std::mt19937_64& random)
    : slope_(parameters.slope), cover_m_(parameters.cover_m) {
  add_waves(16, 25.0, 130.0, parameters.relief_m, random);
  add_waves(32, 2.5, 8.0, parameters.roughness_m, random);
  fill_table();
}

void Ground::add_waves(int count, double min_length_m, double max_length_m, double sigma_m,
                       std::mt19937_64& random) {
  if (sigma_m <= 0.0) return;
  std::uniform_real_distribution<double> angle(0.0, 2.0 * std::numbers::pi);
  std::uniform_real_distribution<double> log_length(std::log(min_length_m), std::log(max_length_m));
  const std::size_t first = waves_.size();

  for (int i = 0; i < count; ++i) {
    const double length_m = std::exp(log_length(random));
    const double direction = angle(random);
    // Whole numbers of waves in the tile, so that it repeats without a seam.
    const Eigen::Vector2d turns(std::round(kTile / length_m * std::cos(direction)),
                                std::round(kTile / length_m * std::sin(direction)));
    waves_.push_back({2.0 * std::numbers::pi / kTile * turns, angle(random), length_m});
  }

  // Waves of one length and direction may add up or cancel: their sum is measured.
  const Ground waves_alone(
      std::vector<Wave>(waves_.begin() + static_cast<std::ptrdiff_t>(first), waves_.end()));
  double squares = 0.0;
  for (const float height_m : waves_alone.table_) squares += height_m * height_m;
  const double scale =
      sigma_m / std::sqrt(squares / static_cast<double>(waves_alone.table_.size()));
  for (std::size_t i = first; i < waves_.size(); ++i) waves_[i].amplitude_m *= scale;
}

void Ground::fill_table() {
  table_.assign(static_cast<std::size_t>(kCells) * kCells, 0.0F);
  for (const Wave& wave : waves_) {
    // Along a row the phase advances by the same angle per node: no sine for each.
    const std::complex<double> step = std::polar(1.0, kCell * wave.wave_vector.x());
    for (int row = 0; row < kCells; ++row) {
      const double start = kCell * row * wave.wave_vector.y() + wave.phase_rad;
      std::complex<double> here = std::polar(wave.amplitude_m, start);
      for (int column = 0; column < kCells; ++column) {
        table_[node(column, row)] += static_cast<float>(here.imag());
        here *= step;
      }
    }
  }

  highest_m_ = *std::max_element(table_.begin(), table_.end());
  fill_blocks();
}

void Ground::fill_blocks() {
  blocks_.assign(static_cast<std::size_t>(kBlocks) * kBlocks, {});
  for (int row = 0; row < kBlocks; ++row) {
    for (int column = 0; column < kBlocks; ++column) {
      float max_m = -std::numeric_limits<float>::infinity();
      float slope_x = 0.0F;
      float slope_y = 0.0F;

      for (int r = row * kBlockCells; r <= (row + 1) * kBlockCells; ++r) {
        for (int c = column * kBlockCells; c <= (column + 1) * kBlockCells; ++c) {
          const float here = table_[node(c, r)];
          max_m = std::max(max_m, here);
          slope_x = std::max(slope_x, std::abs(table_[node(c + 1, r)] - here));
          slope_y = std::max(slope_y, std::abs(table_[node(c, r + 1)] - here));
        }
      }

      blocks_[static_cast<std::size_t>(row) * kBlocks + column] = {
          max_m, std::hypot(slope_x, slope_y) / static_cast<float>(kCell)};
    }
  }
}

double Ground::height(const Eigen::Vector2d& at_m) const {
  double height_m = slope_.dot(at_m);
  for (const Wave& wave : waves_) {
    height_m += wave.amplitude_m * std::sin(wave.wave_vector.dot(at_m) + wave.phase_rad);
  }
  return height_m;
}

Eigen::Vector2d Ground::gradient(const Eigen::Vector2d& at_m) const {
  Eigen::Vector2d gradient = slope_;
  for (const Wave& wave : waves_) {
    gradient +=
        wave.amplitude_m * std::cos(wave.wave_vector.dot(at_m) + wave.phase_rad) * wave.wave_vector;
  }
  return gradient;
}

Eigen::Vector3d Ground::normal(const Eigen::Vector2d& at_m) const {
  const Eigen::Vector2d g = gradient(at_m);
  return Eigen::Vector3d(-g.x(), -g.y(), 1.0).normalized();
}

/// A ray over the table: all in cells, heights above the plane.
struct Ground::Track {
  // A large offset keeps positions positive, so that truncation rounds down.
  static constexpr double kShift = 4096.0 * kCells;
  double u0, v0, z0;     ///< Start.
  double du, dv, climb;  ///< Per metre of the ray.

  Track(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction,
        const Eigen::Vector2d& slope)
      : u0(origin_m.x() / kCell + kShift),
        v0(origin_m.y() / kCell + kShift),
        z0(origin_m.z() - slope.dot(origin_m.head<2>())),
        du(direction.x() / kCell),
        dv(direction.y() / kCell),
        climb(direction.z() - slope.dot(direction.head<2>())) {}
  double u(double t) const { return u0 + du * t; }
  double v(double t) const { return v0 + dv * t; }
  double z(double t) const { return z0 + climb * t; }
};

/// The corners of the cell at (u, v), and the position in it.
struct Ground::Cell {
  double a, b;  ///< In [0, 1).
  double low_left, low_right, high_left, high_right;

  Cell(const std::vector<float>& table, double u, double v) {
    const int column = static_cast<int>(u);
    const int row = static_cast<int>(v);
    a = u - column;
    b = v - row;
    const std::size_t low = node(0, row);
    const std::size_t high = node(0, row + 1);
    const std::size_t left = node(column, 0);
    const std::size_t right = node(column + 1, 0);
    low_left = table[low + left];
    low_right = table[low + right];
    high_left = table[high + left];
    high_right = table[high + right];
  }
  double height() const {
    const double low = low_left + a * (low_right - low_left);
    return low + b * (high_left + a * (high_right - high_left) - low);
  }
  Eigen::Vector2d gradient() const {
    return {((1.0 - b) * (low_right - low_left) + b * (high_right - high_left)) / kCell,
            ((1.0 - a) * (high_left - low_left) + a * (high_right - low_right)) / kCell};
  }
};

const Ground::Block& Ground::block_at(double u, double v) const {
  const int column = (static_cast<int>(u) & (kCells - 1)) / kBlockCells;
  const int row = (static_cast<int>(v) & (kCells - 1)) / kBlockCells;
  return blocks_[static_cast<std::size_t>(row) * kBlocks + column];
}

GroundHit Ground::hit_at(const Track& track, double t, const Eigen::Vector3d& direction) const {
  const Eigen::Vector2d gradient = slope_ + Cell(table_, track.u(t), track.v(t)).gradient();
  const double against = direction.head<2>().dot(gradient) - direction.z();
  return {t, std::abs(against) / std::sqrt(1.0 + gradient.squaredNorm()), against};
}

std::optional<GroundHit> Ground::cast(const Eigen::Vector3d& origin_m,
                                      const Eigen::Vector3d& direction, double max_m) const {
  const Track track(origin_m, direction, slope_);
  const double level_speed = direction.head<2>().norm();
  const double u_inverse = 1.0 / track.du;  // infinite where the ray does not move along u
  const double v_inverse = 1.0 / track.dv;
  double t = 0.0;
  double clearance = track.z0 - Cell(table_, track.u0, track.v0).height();
  if (clearance <= 0.0) return hit_at(track, 0.0, direction);

  while (t < max_m) {
    const double z = track.z(t);
    if (track.climb >= 0.0 && z > highest_m_) return std::nullopt;

    const double u = track.u(t);
    const double v = track.v(t);

    // Slightly beyond the border, into the next block.
    const double border =
        t + 1e-6 + std::min(to_border(u, track.du, u_inverse), to_border(v, track.dv, v_inverse));
    const Block& block = block_at(u, v);
    if (std::min(z, z + track.climb * (border - t)) > block.max_m) {
      t = border;
      clearance = -1.0;  // not known
      continue;
    }

    if (clearance < 0.0) clearance = std::max(0.0, z - Cell(table_, u, v).height());
    const double closing = block.slope * level_speed - track.climb;
    const double step = closing > 0.0 ? std::max(clearance / closing, kLeastStep) : border - t;
    const double next = std::min(border, t + step);
    const double after = track.z(next) - Cell(table_, track.u(next), track.v(next)).height();

    if (after <= 0.0) {
      // Linear between the two: the cells are larger than the least step.
      const double crossing = t + (next - t) * clearance / (clearance - after);
      if (crossing >= max_m) return std::nullopt;
      return hit_at(track, crossing, direction);
    }

    t = next;
    clearance = after;
  }

  return std::nullopt;
}

}  // namespace understory::sim
