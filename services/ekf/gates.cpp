#include "services/ekf/gates.hpp"

#include "services/ekf/chi_squared.hpp"
#include "services/ekf/ground_marks.hpp"

namespace understory::ekf {
namespace {

constexpr double kStationaryProbability = 1.0 - 1e-6;

}  // namespace

std::vector<double> set_gates(double probability, int max_landmarks) {
  std::vector<double> gates{0.0};
  for (int k = 1; k <= max_landmarks; ++k) {
    gates.push_back(chi_squared_quantile(probability, 2 * k));
  }
  return gates;
}

Gates::Gates(const EkfGateParameters& parameters, int max_landmarks)
    : landmark(chi_squared_quantile(parameters.landmark_probability, 2)),
      set(set_gates(parameters.set_probability, max_landmarks)),
      rejoin(set_gates(parameters.rejoin_probability, static_cast<int>(kMaxSearched))),
      stationary{chi_squared_quantile(kStationaryProbability, 2),
                 chi_squared_quantile(kStationaryProbability, 3),
                 chi_squared_quantile(kStationaryProbability, 2 * kGroundMarks)} {}

}  // namespace understory::ekf
