// Uncertain spatial relationships (Smith, Self & Cheeseman 1990), as the thesis on submaps uses
// them (§2.3.4, §3.4.2).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/geometry/se2.hpp"

namespace understory::eval::experiments::partition {

// Poses here are (x, y [m], phi [rad]), and a covariance is that of these three numbers. Everywhere
// else a pose is perturbed on the right.

/// p_ij (+) p_jk, equation 2.14.
Eigen::Vector3d oplus(const Eigen::Vector3d& ij, const Eigen::Vector3d& jk);
/// (-) p_ij, equation 2.18.
Eigen::Vector3d ominus(const Eigen::Vector3d& ij);

/// d(p_ij (+) p_jk) / d(p_ij): J_1 of equation 2.16.
Eigen::Matrix3d oplus_by_first(const Eigen::Vector3d& ij, const Eigen::Vector3d& jk);
/// d(p_ij (+) p_jk) / d(p_jk): J_2 of equation 2.16.
Eigen::Matrix3d oplus_by_second(const Eigen::Vector3d& ij);
/// d((-) p_ij) / d(p_ij).
Eigen::Matrix3d ominus_jacobian(const Eigen::Vector3d& ij);

/// How the covariance of a relation follows from the joint covariance of its ends.
enum class Propagation : std::uint8_t {
  kCompounding,  ///< Equations 3.1 and 3.2: first order.
  kUnscented,    ///< Unscented transform (Julier & Uhlmann), as Grisetti et al. [17 there] do.
};

/// Poses and points in the frame of a pose.
struct Relations {
  Eigen::VectorXd mean;        ///< x, y, phi of each pose, then x, y of each point.
  Eigen::MatrixXd covariance;  ///< Of all of them together.
};

/// (-) p_o (+) p_i for each pose and each point. `joint`: covariance of p_o's three numbers, then
/// of the poses' and the points'.
Relations relations(const Eigen::Vector3d& origin, const std::vector<Eigen::Vector3d>& poses,
                    const std::vector<Eigen::Vector2d>& points, const Eigen::MatrixXd& joint,
                    Propagation propagation);

}  // namespace understory::eval::experiments::partition
