#include "eval/experiments/partition/policies.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <string_view>

namespace understory::eval::experiments::partition {
namespace {

/// A preliminary cut of the dynamic policies (§5.3), and how long they may wait [m].
constexpr double kDynamic_m = 100.0;
constexpr double kLongest_m = 1000.0;
constexpr double kTurn_deg = 45.0;
/// Nodes and landmarks of a submap of the policy "size".
constexpr std::array<double, 2> kSizes{100.0, 200.0};

double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

struct PublishedRow {
  std::string_view route;
  std::string_view policy;
  double value;  ///< Size [m] or threshold.
  bool is_closed;
  Published figures;
};

constexpr std::nullopt_t kNo = std::nullopt;
const std::array<PublishedRow, 31> kPublished{{
    // Table 5.1; 400 and 500 m did not partition the drive.
    {"urban", "distance", 100, false, {0.1569, 23.9, 1.4, kNo}},
    {"urban", "distance", 200, false, {0.2637, 39.0, 3.8, kNo}},
    {"urban", "distance", 300, false, {0.0295, kNo, kNo, kNo}},
    // Table 5.2
    {"urban-countryside", "distance", 100, false, {0.0261, 13.4, 1.2, kNo}},
    {"urban-countryside", "distance", 200, false, {0.0044, 22.9, 0.9, kNo}},
    {"urban-countryside", "distance", 300, false, {0.0045, 26.2, 0.7, kNo}},
    {"urban-countryside", "distance", 400, false, {0.0012, kNo, kNo, kNo}},
    {"urban-countryside", "distance", 500, false, {0.0027, kNo, kNo, kNo}},
    // Table 5.3
    {"urban", "distance", 100, true, {3.1915, kNo, kNo, kNo}},
    {"urban", "distance", 200, true, {4.4185, kNo, kNo, kNo}},
    {"urban", "distance", 300, true, {3.4109, kNo, kNo, kNo}},
    {"urban", "distance", 400, true, {4.2739, kNo, kNo, kNo}},
    {"urban", "distance", 500, true, {5.7739, kNo, kNo, kNo}},
    // Table 5.4
    {"urban", "sparse", 1, false, {0.0297, 26.7, 1.5, 121.6}},
    {"urban", "sparse", 2, false, {0.1326, 20.8, 1.4, 101.3}},
    {"urban", "sparse", 3, false, {0.1194, 22.2, 1.3, 101.4}},
    {"urban", "dense", 4, false, {0.1523, 35.1, 1.3, 121.7}},
    {"urban", "dense", 5, false, {0.2526, 36.6, 0.4, 121.7}},
    {"urban", "dense", 6, false, {0.1342, kNo, kNo, 202.7}},
    // Table 5.5
    {"urban-countryside", "sparse", 1, false, {0.1997, 13.7, 0.4, 111.2}},
    {"urban-countryside", "sparse", 2, false, {0.6562, 13.1, 1.4, 101.1}},
    {"urban-countryside", "sparse", 3, false, {0.5809, 13.5, 1.3, 101.0}},
    {"urban-countryside", "dense", 4, false, {0.0626, 44.7, 0.8, 222.2}},
    {"urban-countryside", "dense", 5, false, {0.0989, 44.9, 0.7, 222.3}},
    {"urban-countryside", "dense", 6, false, {0.1075, 47.5, 1.0, 222.2}},
    // Table 5.6
    {"urban", "sparse", 1, true, {5.1349, kNo, kNo, 139.4}},
    {"urban", "sparse", 2, true, {4.4431, kNo, kNo, 118.4}},
    {"urban", "sparse", 3, true, {5.1750, kNo, kNo, 118.7}},
    {"urban", "dense", 4, true, {4.8201, kNo, kNo, 144.4}},
    {"urban", "dense", 5, true, {4.0145, kNo, kNo, 143.2}},
    {"urban", "dense", 6, true, {5.2813, kNo, kNo, 232.1}},
}};

}  // namespace

std::string Policy::label() const {
  if (name == "sparse") return fmt::format("sparse < {:g}", threshold);
  if (name == "dense") return fmt::format("dense > {:g}", threshold);
  if (name == "turn") return fmt::format("turn of {:g} deg", threshold);
  if (name == "size") return fmt::format("size {:g}", threshold);
  return size_m > 0.0 ? fmt::format("{:g} m", size_m) : name;
}

geoslam_mapper::smoothing::CutPolicy Policy::cuts() const {
  geoslam_mapper::SmoothingMapperParameters parameters;
  set(parameters);
  return geoslam_mapper::smoothing::cut_policy(parameters, 1.0);
}

void Policy::set(geoslam_mapper::SmoothingMapperParameters& parameters) const {
  parameters.condense_m = size_m;
  parameters.condense_of_range = 1e6;
  parameters.cut_longest_m = kLongest_m;
  if (name == "sparse") parameters.cut_sparse = threshold;
  if (name == "dense") parameters.cut_dense = threshold;
  if (name == "turn") parameters.cut_turn_rad = radians(threshold);
  if (name == "size") parameters.cut_size = static_cast<int>(threshold);
}

std::vector<Policy> static_policies(const std::vector<double>& sizes_m) {
  std::vector<Policy> policies;
  policies.reserve(sizes_m.size());
  for (const double size_m : sizes_m) policies.push_back({"distance", size_m, size_m});
  return policies;
}

std::vector<Policy> dynamic_policies() {
  std::vector<Policy> policies;
  policies.reserve(9);
  for (const double least : {1.0, 2.0, 3.0}) policies.push_back({"sparse", kDynamic_m, least});
  for (const double most : {4.0, 5.0, 6.0}) policies.push_back({"dense", kDynamic_m, most});
  policies.push_back({"turn", kDynamic_m, kTurn_deg});
  // Ends by its size alone.
  for (const double size : kSizes) policies.push_back({"size", kLongest_m, size});
  return policies;
}

std::optional<Published> published(const std::string& route, const Policy& policy, bool is_closed) {
  const auto found = std::find_if(kPublished.begin(), kPublished.end(), [&](const auto& row) {
    return row.route == route && row.policy == policy.name && row.value == policy.threshold &&
           row.is_closed == is_closed;
  });
  if (found == kPublished.end()) return std::nullopt;
  return found->figures;
}

}  // namespace understory::eval::experiments::partition
