#include "deploy/cli/said_pose.hpp"

#include <cmath>
#include <numbers>

namespace understory::cli {
namespace {

/// CLI::Range accepts NaN.
CLI::Validator finite() {
  return {[](const std::string& text) {
            double value = 0.0;
            const bool is_good = CLI::detail::lexical_cast(text, value) && std::isfinite(value);
            return is_good ? std::string() : text + " is no finite number";
          },
          "", "finite"};
}

}  // namespace

geometry::SE2WithCovariance SaidPose::pose() const {
  constexpr double kRadPerDegree = std::numbers::pi / 180.0;
  const Eigen::Vector3d sigma(sigma_m, sigma_m, sigma_deg * kRadPerDegree);
  return {geometry::SE2(*x_m, *y_m, *theta_deg * kRadPerDegree),
          sigma.array().square().matrix().asDiagonal()};
}

void add_said_pose(CLI::App& command, SaidPose& pose, const std::string& what,
                   const std::string& prefix) {
  auto* const x = command.add_option("--x-m", pose.x_m, "[m] Position of " + what + ": ahead");
  auto* const y = command.add_option("--y-m", pose.y_m, "[m] To the left");
  auto* const theta =
      command.add_option("--theta-deg", pose.theta_deg, "[deg] Heading, to the left");
  for (auto* const one : {x, y, theta}) {
    one->check(finite());
    for (auto* const other : {x, y, theta})
      if (one != other) one->needs(other);
  }
  command
      .add_option("--" + prefix + "sigma-m", pose.sigma_m, "[m] Standard deviation of x and of y")
      ->check(finite())
      ->check(CLI::Range(1e-4, 1e3))
      ->capture_default_str()
      ->needs(x);
  command
      .add_option("--" + prefix + "sigma-deg", pose.sigma_deg,
                  "[deg] Standard deviation of the heading")
      ->check(finite())
      ->check(CLI::Range(1e-3, 180.0))
      ->capture_default_str()
      ->needs(x);
}

}  // namespace understory::cli
