#include "sim/ground.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace understory::sim {
namespace {

constexpr double kTile = 256.0;
constexpr double kCell = 0.5;
constexpr int kCells = 512;     // a power of two: indices wrap by masking
constexpr int kBlockCells = 8;  // 4 m
constexpr int kBlocks = kCells / kBlockCells;
constexpr double kBlock = kCell * kBlockCells;
constexpr double kLeastStep = 0.1;

int cell_of(double x_m) { return static_cast<int>(std::floor(x_m / kCell)); }
std::size_t node(int column, int row) {
  return static_cast<std::size_t>(row & (kCells - 1)) * kCells + (column & (kCells - 1));
}

/// Distance along the ray to where it leaves the block of `position` in one axis.
double to_block_border(double position, double direction) {
  if (direction == 0.0) return std::numeric_limits<double>::infinity();
  const double low = std::floor(position / kBlock) * kBlock;
  return ((direction > 0.0 ? low + kBlock : low) - position) / direction;
}

}  // namespace

Ground::Ground() { fill_table(); }

Ground::Ground(const GroundParameters& parameters, std::mt19937_64& random)
    : slope_(parameters.slope) {
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
  double power = 0.0;
  for (int i = 0; i < count; ++i) {
    const double length_m = std::exp(log_length(random));
    const double direction = angle(random);
    // Whole numbers of waves in the tile, so that it repeats without a seam.
    const Eigen::Vector2d turns(std::round(kTile / length_m * std::cos(direction)),
                                std::round(kTile / length_m * std::sin(direction)));
    waves_.push_back({2.0 * std::numbers::pi / kTile * turns, angle(random), length_m});
    power += 0.5 * length_m * length_m;
  }
  for (std::size_t i = first; i < waves_.size(); ++i) {
    waves_[i].amplitude_m *= sigma_m / std::sqrt(power);
  }
}

void Ground::fill_table() {
  table_.assign(static_cast<std::size_t>(kCells) * kCells, 0.0F);
  if (!waves_.empty()) {
    for (int row = 0; row < kCells; ++row) {
      for (int column = 0; column < kCells; ++column) {
        const Eigen::Vector2d at_m(column * kCell, row * kCell);
        table_[node(column, row)] = static_cast<float>(height(at_m) - slope_.dot(at_m));
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

double Ground::table_height(double x_m, double y_m) const {
  const double u = x_m / kCell;
  const double v = y_m / kCell;
  const double column = std::floor(u);
  const double row = std::floor(v);
  const double a = u - column;
  const double b = v - row;
  const int c = static_cast<int>(column);
  const int r = static_cast<int>(row);
  const double low = table_[node(c, r)] + a * (table_[node(c + 1, r)] - table_[node(c, r)]);
  const double high =
      table_[node(c, r + 1)] + a * (table_[node(c + 1, r + 1)] - table_[node(c, r + 1)]);
  return low + b * (high - low);
}

const Ground::Block& Ground::block_at(double x_m, double y_m) const {
  const int column = (cell_of(x_m) & (kCells - 1)) / kBlockCells;
  const int row = (cell_of(y_m) & (kCells - 1)) / kBlockCells;
  return blocks_[static_cast<std::size_t>(row) * kBlocks + column];
}

double Ground::cast(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction,
                    double max_m) const {
  // Heights from here on are above the plane; the ray stays straight.
  const double z0 = origin_m.z() - slope_.dot(origin_m.head<2>());
  const double climb = direction.z() - slope_.dot(direction.head<2>());
  const double level_speed = direction.head<2>().norm();
  double t = 0.0;
  double clearance = z0 - table_height(origin_m.x(), origin_m.y());
  if (clearance <= 0.0) return 0.0;
  while (t < max_m) {
    if (climb >= 0.0 && z0 + climb * t > highest_m_) return max_m;
    const double x = origin_m.x() + t * direction.x();
    const double y = origin_m.y() + t * direction.y();
    // A hair beyond the border, to be in the next block.
    const double border =
        t + 1e-6 + std::min(to_block_border(x, direction.x()), to_block_border(y, direction.y()));
    const Block& block = block_at(x, y);
    if (z0 + climb * t > block.max_m && z0 + climb * std::min(border, max_m) > block.max_m) {
      t = border;
      clearance = -1.0;  // not known
      continue;
    }
    if (clearance < 0.0) clearance = std::max(0.0, z0 + climb * t - table_height(x, y));
    const double closing = block.slope * level_speed - climb;
    const double step = closing > 0.0 ? std::max(clearance / closing, kLeastStep) : border - t;
    const double next = std::min(border, t + step);
    const double after =
        z0 + climb * next -
        table_height(origin_m.x() + next * direction.x(), origin_m.y() + next * direction.y());
    if (after <= 0.0) {
      // Straight between the two: the cells are larger than the least step.
      return std::min(max_m, t + (next - t) * clearance / (clearance - after));
    }
    t = next;
    clearance = after;
  }
  return max_m;
}

}  // namespace understory::sim
