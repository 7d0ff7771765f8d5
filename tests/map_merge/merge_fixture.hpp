// Two maps of one forest, with the truth about them.
#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "common/map_file/stored_map.hpp"
#include "common/map_merge/alignment.hpp"
#include "common/map_merge/fusion.hpp"
#include "sim/forest.hpp"

namespace understory::test {

/// How two maps are made.
struct SceneOptions {
  double width_m = 200.0;  ///< Of each map, and its height.
  double overlap = 0.5;    ///< Share of the width that both cover; below 0: a gap.
  double common = 0.64;    ///< Share of a map's landmarks in the overlap that the other has, too.
  double sigma_m = 0.05;   ///< Of a landmark, per axis, independent.
  double common_sigma_m = 0.0;    ///< Of each map as a whole, per axis.
  double common_sigma_rad = 0.0;  ///< Likewise of its heading, about its own origin.
  double stated_factor = 1.0;     ///< Stated sigmas over the true ones.
  double min_distance_m = 5.0;    ///< Between trees, before they are moved.
  double jitter_m = 1.5;
};

/// A map as it was made: landmarks, and which tree each of them is.
struct MadeMap {
  std::vector<model::MapLandmark> landmarks;
  std::vector<std::size_t> trees;
};

/// Two of them, each in a frame of its own.
struct Scene {
  MadeMap first;
  MadeMap second;
  geometry::SE2 first_T_second;

  std::size_t in_common() const {
    return static_cast<std::size_t>(std::ranges::count_if(second.trees, [&](std::size_t tree) {
      return std::ranges::find(first.trees, tree) != first.trees.end();
    }));
  }
};

inline geometry::SE2 random_frame(std::mt19937_64& random) {
  std::uniform_real_distribution<double> angle(-3.14, 3.14);
  std::uniform_real_distribution<double> side(-300.0, 300.0);
  const double x = side(random);
  const double y = side(random);
  return {x, y, angle(random)};
}

/// The trees within [low, high) of x as a map in its own frame.
inline MadeMap observe(const std::vector<Eigen::Vector2d>& trees, double low_m, double high_m,
                       std::uint32_t map_id, const geometry::SE2& map_T_world,
                       const SceneOptions& options, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const Eigen::Vector3d whole(options.common_sigma_m * normal(random),
                              options.common_sigma_m * normal(random),
                              options.common_sigma_rad * normal(random));
  const geometry::SE2 shift = geometry::SE2::Exp(whole);
  MadeMap map;
  for (std::size_t i = 0; i < trees.size(); ++i) {
    if (trees[i].x() < low_m || trees[i].x() >= high_m) continue;
    if (unit(random) >= options.common) continue;
    model::MapLandmark one;
    one.id = map_file::landmark_id(map_id, map.landmarks.size() + 1);
    const Eigen::Vector2d noise(options.sigma_m * normal(random), options.sigma_m * normal(random));
    const Eigen::Vector2d true_place = map_T_world * trees[i];
    one.position_m = shift * true_place + noise;

    Eigen::Matrix<double, 2, 3> jacobian;
    jacobian << Eigen::Matrix2d::Identity(), geometry::perpendicular(true_place);
    const Eigen::Vector3d variances(options.common_sigma_m * options.common_sigma_m,
                                    options.common_sigma_m * options.common_sigma_m,
                                    options.common_sigma_rad * options.common_sigma_rad);
    one.covariance_m2 = options.stated_factor * options.stated_factor *
                        (options.sigma_m * options.sigma_m * Eigen::Matrix2d::Identity() +
                         jacobian * variances.asDiagonal() * jacobian.transpose());
    one.radius_m = 0.1;
    one.observation_count = 5;
    map.landmarks.push_back(one);
    map.trees.push_back(i);
  }
  return map;
}

/// Two maps of these trees, of [0, width] and of what lies `overlap` of it before the first one's
/// right border.
inline Scene observe_twice(const std::vector<Eigen::Vector2d>& trees, const SceneOptions& options,
                           std::mt19937_64& random) {
  const geometry::SE2 first_T_world = random_frame(random);
  const geometry::SE2 second_T_world = random_frame(random);
  const double begin_m = (1.0 - options.overlap) * options.width_m;
  Scene scene;
  scene.first = observe(trees, 0.0, options.width_m, 1, first_T_world, options, random);
  scene.second =
      observe(trees, begin_m, begin_m + options.width_m, 2, second_T_world, options, random);
  scene.first_T_second = first_T_world * second_T_world.inverse();
  return scene;
}

/// Trees in which both maps fit.
inline std::vector<Eigen::Vector2d> random_trees(const SceneOptions& options,
                                                 std::mt19937_64& random) {
  sim::ForestParameters forest;
  forest.side_m = options.width_m * (2.0 - std::min(options.overlap, 1.0));
  forest.min_distance_m = options.min_distance_m;
  forest.jitter_sigma_m = options.jitter_m;
  std::vector<Eigen::Vector2d> trees = sim::make_forest(forest, random).trunks_m;
  std::erase_if(trees, [&](const Eigen::Vector2d& tree) {
    return tree.y() < 0.0 || tree.y() > options.width_m;
  });
  return trees;
}

inline Scene random_scene(const SceneOptions& options, std::mt19937_64& random) {
  return observe_twice(random_trees(options, random), options, random);
}

/// Log(estimate^-1 truth).
inline Eigen::Vector3d error_of(const map_merge::Alignment& found, const Scene& scene) {
  return (found.first_T_second.inverse() * scene.first_T_second).Log();
}
/// Normalised squared error of the motion, three degrees of freedom.
inline double nees_of(const map_merge::Alignment& found, const Scene& scene) {
  const Eigen::Vector3d error = error_of(found, scene);
  return error.dot(found.covariance.ldlt().solve(error));
}
/// Farthest that the motion puts one of the second map's landmarks from where it belongs [m].
inline double farthest_m(const map_merge::Alignment& found, const Scene& scene) {
  double farthest = 0.0;
  for (const model::MapLandmark& one : scene.second.landmarks)
    farthest = std::max(
        farthest,
        (found.first_T_second * one.position_m - scene.first_T_second * one.position_m).norm());
  return farthest;
}
/// Pairs that are not one tree.
inline std::size_t wrong_pairs(const map_merge::Alignment& found, const Scene& scene) {
  return static_cast<std::size_t>(
      std::ranges::count_if(found.pairs, [&](const map_merge::LandmarkPair& pair) {
        return scene.first.trees[pair.first] != scene.second.trees[pair.second];
      }));
}

/// As stored, with a short trajectory.
inline map_file::StoredMap stored(const MadeMap& made, std::uint32_t map_id) {
  map_file::StoredMap map;
  map.map_id = map_id;
  map.name = "map " + std::to_string(map_id);
  map.landmarks.reserve(made.landmarks.size());
  for (const model::MapLandmark& one : made.landmarks)
    map.landmarks.push_back({one, std::nullopt, std::nullopt});
  for (std::uint64_t i = 1; i <= 5; ++i) {
    const auto along = static_cast<double>(i);
    map.keyframes.push_back({i, static_cast<model::Utime>(i) * 1'000'000,
                             geometry::SE2(3.0 * along, along, 0.1 * along),
                             1e-3 * along * Eigen::Matrix3d::Identity()});
  }
  return map;
}

}  // namespace understory::test
