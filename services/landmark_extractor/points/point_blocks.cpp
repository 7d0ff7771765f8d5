#include "services/landmark_extractor/points/point_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "services/landmark_extractor/lanes.hpp"
#include "services/landmark_extractor/points/spin_fit.hpp"

namespace understory::landmark_extractor::points {
namespace {

constexpr std::size_t kSize = PointBlock::kSize;

typedef float Four __attribute__((vector_size(16)));

[[gnu::always_inline]] inline Four load(const void* from) {
  Four result;
  std::memcpy(&result, from, sizeof(result));
  return result;
}

[[gnu::always_inline]] inline void store(Four value, void* to) {
  std::memcpy(to, &value, sizeof(value));
}

/// Transposes rows and columns.
[[gnu::always_inline]] inline void transpose(std::array<Four, 4>& rows) {
  const Four low_a = __builtin_shufflevector(rows[0], rows[1], 0, 4, 1, 5);
  const Four low_b = __builtin_shufflevector(rows[2], rows[3], 0, 4, 1, 5);
  const Four high_a = __builtin_shufflevector(rows[0], rows[1], 2, 6, 3, 7);
  const Four high_b = __builtin_shufflevector(rows[2], rows[3], 2, 6, 3, 7);
  rows[0] = __builtin_shufflevector(low_a, low_b, 0, 1, 4, 5);
  rows[1] = __builtin_shufflevector(low_a, low_b, 2, 3, 6, 7);
  rows[2] = __builtin_shufflevector(high_a, high_b, 0, 1, 4, 5);
  rows[3] = __builtin_shufflevector(high_a, high_b, 2, 3, 6, 7);
}

[[gnu::always_inline]] inline void take_apart(std::span<const model::SweepPoint> points,
                                              PointBlock& block) {
  // x, y, z and the time are the first four numbers of a point.
  static_assert(offsetof(model::SweepPoint, x_m) == 0 && offsetof(model::SweepPoint, y_m) == 4 &&
                offsetof(model::SweepPoint, z_m) == 8 && offsetof(model::SweepPoint, time_s) == 12);

  std::size_t i = 0;
  for (; i + 4 <= points.size(); i += 4) {
    // Prefetches the next block.
    __builtin_prefetch(points.data() + i + kSize);
    __builtin_prefetch(points.data() + i + kSize + 2);

    std::array<Four, 4> rows{load(&points[i]), load(&points[i + 1]), load(&points[i + 2]),
                             load(&points[i + 3])};
    transpose(rows);

    store(rows[0], &block.x[i]);
    store(rows[1], &block.y[i]);
    store(rows[2], &block.z[i]);
    store(rows[3], &block.time[i]);
  }

  for (; i < points.size(); ++i) {
    block.x[i] = points[i].x_m;
    block.y[i] = points[i].y_m;
    block.z[i] = points[i].z_m;
    block.time[i] = points[i].time_s;
  }
}

/// The inverse.
[[gnu::always_inline]] inline void put_together(std::size_t count, PointBlock& block) {
  static_assert(sizeof(RingPoint) == 2 * sizeof(Four) && offsetof(RingPoint, azimuth_rad) == 12 &&
                offsetof(RingPoint, range_m) == 16 && offsetof(RingPoint, is_in_range) == 28);
  for (std::size_t i = 0; i < count; i += 4) {
    std::array<Four, 4> first{load(&block.x[i]), load(&block.y[i]), load(&block.z[i]),
                              load(&block.azimuth[i])};
    std::array<Four, 4> second{load(&block.range[i]), load(&block.height[i]), load(&block.time[i]),
                               load(&block.in_range[i])};
    transpose(first);
    transpose(second);
    for (std::size_t k = 0; k < 4; ++k) {
      store(first[k], &block.points[i + k].x_m);
      store(second[k], &block.points[i + k].range_m);
    }
  }
}

[[gnu::always_inline]] inline void level(const Levelling& by, std::size_t count,
                                         PointBlock& block) {
  // A copy, so that writes to the block cannot change it.
  const Eigen::Matrix3f turn = by.level_R_vehicle;
  for (std::size_t i = 0; i < count; ++i) {
    const float x = turn(0, 0) * block.x[i] + turn(0, 1) * block.y[i] + turn(0, 2) * block.z[i];
    const float y = turn(1, 0) * block.x[i] + turn(1, 1) * block.y[i] + turn(1, 2) * block.z[i];
    const float z = turn(2, 0) * block.x[i] + turn(2, 1) * block.y[i] + turn(2, 2) * block.z[i];
    block.x[i] = x;
    block.y[i] = y;
    block.z[i] = z;
  }
}

/// At most kSize places; whole registers.
[[gnu::always_inline]] inline void subtract_surface(const float* x, const float* y, const float* z,
                                                    std::size_t count, const GroundGrid& grid,
                                                    const GroundPatch* patches, float* height) {
  static_assert(sizeof(GroundPatch) == sizeof(Four));
  const GroundGrid at = grid;

  std::array<float, kSize> a;
  std::array<float, kSize> b;
  std::array<std::int32_t, kSize> index;

  // Each point lies in one span of the grid, at the fractions a and b of it.
  for (std::size_t i = 0; i < count; ++i) {
    const float u = at.place(x[i], at.corner_x_m);
    const float v = at.place(y[i], at.corner_y_m);
    const auto column = static_cast<std::int32_t>(u);
    const auto row = static_cast<std::int32_t>(v);

    a[i] = u - static_cast<float>(column);
    b[i] = v - static_cast<float>(row);
    index[i] = row * at.nodes_per_side + column;
  }

  // Four patches at a time give the height of the surface.
  for (std::size_t i = 0; i < count; i += 4) {
    std::array<Four, 4> rows{load(patches + index[i]), load(patches + index[i + 1]),
                             load(patches + index[i + 2]), load(patches + index[i + 3])};
    transpose(rows);

    const Four along_x = load(&a[i]);
    const Four along_y = load(&b[i]);
    store(load(z + i) - (rows[0] + along_x * rows[1] + along_y * (rows[2] + along_x * rows[3])),
          height + i);
  }
}

[[gnu::always_inline]] inline void locate_all(std::span<const model::SweepPoint> points,
                                              const Levelling& by, const GroundGrid& grid,
                                              PointBlock& block) {
  // Values beyond the last point are computed and ignored.
  const std::size_t count = padded_to_lanes(points.size());
  take_apart(points, block);
  level(by, count, block);

  const GroundGrid at = grid;
  const float x0 = by.sensor_m.x();
  const float y0 = by.sensor_m.y();
  const float nearest2 = by.min_range_m * by.min_range_m;
  const float farthest2 = by.max_range_m * by.max_range_m;
  const std::int32_t nowhere = at.nowhere();

  for (std::size_t i = 0; i < count; ++i) {
    const float dx = block.x[i] - x0;
    const float dy = block.y[i] - y0;
    const float range2 = dx * dx + dy * dy;

    constexpr auto kCells = static_cast<float>(GroundGrid::kCellsPerSpan);
    const auto u = static_cast<std::int32_t>(kCells * at.place(block.x[i], at.corner_x_m));
    const auto v = static_cast<std::int32_t>(kCells * at.place(block.y[i], at.corner_y_m));
    const std::int32_t cell =
        ((v & 3) * 4 + (u & 3)) * at.plane + (v >> 2) * at.nodes_per_side + (u >> 2);

    // NaN fails every comparison.
    const bool counts = static_cast<int>(range2 >= nearest2) &
                        static_cast<int>(range2 <= farthest2) &
                        static_cast<int>(std::abs(block.z[i]) < kHighest_m);
    block.cell[i] = counts ? cell : nowhere;
  }

  static_assert(GroundGrid::kCellsPerSpan == 4);
}

[[gnu::always_inline]] inline void place_all(std::span<const model::SweepPoint> points,
                                             const Levelling& by, const GroundGrid& grid,
                                             const GroundPatch* patches, PointBlock& block) {
  const std::size_t count = padded_to_lanes(points.size());
  take_apart(points, block);
  level(by, count, block);

  const Eigen::Vector3f sensor = by.sensor_m;
  const Eigen::Vector3f velocity = by.velocity_mps;
  const float nearest2 = by.min_range_m * by.min_range_m;
  const float farthest2 = by.max_range_m * by.max_range_m;

  for (std::size_t i = 0; i < count; ++i) {
    const float dx = block.x[i] - (sensor.x() + velocity.x() * block.time[i]);
    const float dy = block.y[i] - (sensor.y() + velocity.y() * block.time[i]);
    const float range2 = dx * dx + dy * dy;

    block.range[i] = std::sqrt(range2);
    block.azimuth[i] = fast_atan2(dy, dx);

    // NaN fails every comparison.
    const bool counts = static_cast<int>(range2 >= nearest2) &
                        static_cast<int>(range2 <= farthest2) &
                        static_cast<int>(std::abs(block.z[i]) < kHighest_m);
    block.in_range[i] = counts ? 1.0F : 0.0F;
  }

  subtract_surface(block.x.data(), block.y.data(), block.z.data(), count, grid, patches,
                   block.height.data());
  put_together(count, block);
}

#if defined(__x86_64__)
// Without fused multiplication: the same numbers on every machine.
[[gnu::target("avx2")]] void locate_with_avx2(std::span<const model::SweepPoint> points,
                                              const Levelling& by, const GroundGrid& grid,
                                              PointBlock& block) {
  locate_all(points, by, grid, block);
}
[[gnu::target("avx2")]] void place_with_avx2(std::span<const model::SweepPoint> points,
                                             const Levelling& by, const GroundGrid& grid,
                                             const GroundPatch* patches, PointBlock& block) {
  place_all(points, by, grid, patches, block);
}
[[gnu::target("avx2")]] void heights_with_avx2(const float* x, const float* y, const float* z,
                                               std::size_t count, const GroundGrid& grid,
                                               const GroundPatch* patches, float* height) {
  subtract_surface(x, y, z, count, grid, patches, height);
}
#endif

}  // namespace

void locate_block(std::span<const model::SweepPoint> points, const Levelling& by,
                  const GroundGrid& grid, PointBlock& block) {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) return locate_with_avx2(points, by, grid, block);
#endif
  locate_all(points, by, grid, block);
}

void place_block(std::span<const model::SweepPoint> points, const Levelling& by,
                 const GroundGrid& grid, const GroundPatch* patches, PointBlock& block) {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) return place_with_avx2(points, by, grid, patches, block);
#endif
  place_all(points, by, grid, patches, block);
}

void heights_above(const float* x, const float* y, const float* z, std::size_t count,
                   const GroundGrid& grid, const GroundPatch* patches, float* height) {
  for (std::size_t i = 0; i < count; i += kSize) {
    const std::size_t part = std::min(kSize, count - i);
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2")) {
      heights_with_avx2(x + i, y + i, z + i, part, grid, patches, height + i);
      continue;
    }
#endif
    subtract_surface(x + i, y + i, z + i, part, grid, patches, height + i);
  }
}

}  // namespace understory::landmark_extractor::points
