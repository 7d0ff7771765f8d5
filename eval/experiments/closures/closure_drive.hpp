// Simulated drives as graphs of poses, and the loop closures that are sent during them.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/submap.hpp"

namespace understory::eval::experiments::closures {

/// Origin of a closure.
enum class Kind : std::uint8_t {
  kRight,       ///< True relative pose and the noise that it states.
  kAlone,       ///< Wrong: another place, a random pose within 6 m of it.
  kOneWindow,   ///< Wrong, in a group: windows of one stretch of 20 m.
  kSuccessive,  ///< Wrong, in a group: one look-alike patch, seen from up to 50 m of path.
  kRows,        ///< Wrong, in a group: a pass of 50 to 300 m taken for another row.
};
inline constexpr std::size_t kKinds = 5;
/// Name of a kind in tables and documents.
const char* name_of(Kind kind);

/// Everything of the drives but the seed.
struct ClosurePlan {
  double stated = 1.0;        ///< Stated standard deviation of the odometry over the true one.
  double yaw_bias_rad = 0.0;  ///< Largest error of yaw that all steps share, not stated.
  int alone = 12;             ///< Wrong closures that agree with no other.
  int groups = 4;             ///< Of kOneWindow and of kSuccessive each.
  int rows = 0;               ///< Groups of kRows.
};

/// A closure as it is sent, with its ends: each lies at a node, or between it and the next one.
struct SentClosure {
  model::LoopClosure closure;
  std::size_t from = 0;
  std::size_t to = 0;
  geometry::SE2 from_T_end;  ///< Of the end in the frame of its node.
  geometry::SE2 to_T_end;
  Kind kind = Kind::kRight;
  int group = -1;  ///< Closures of one group are wrong alike.
};

/// A drive of 2 to 4 km with a node every 10 m.
struct ClosureDrive {
  std::vector<geometry::SE2> truth;
  std::vector<geometry::SE2> measured;  ///< measured[i]: from node i to node i + 1.
  Eigen::Matrix3d covariance;           ///< Stated for each of them (right perturbation).
  std::vector<SentClosure> sent;        ///< In order of their newer ends.
};

/// The drive of a seed: by turns laps of a rounded rectangle, laps of a wavy ring, and a road there
/// and back twice.
ClosureDrive make_closure_drive(const ClosurePlan& plan, std::uint64_t seed);

/// The closure between its nodes, with its covariance.
geometry::SE2WithCovariance between_nodes(const SentClosure& sent);

}  // namespace understory::eval::experiments::closures
