// Where the path is cut, against the definition of each rule.
#include "services/geoslam_mapper/smoothing/cutting.hpp"

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "tests/catch.hpp"

using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

/// A path with turns, few and many landmarks, and nodes that are gone.
std::vector<CutNode> random_path(std::mt19937_64& random) {
  std::uniform_real_distribution<double> step_m(0.3, 4.0);
  std::uniform_int_distribution<int> count(0, 10);
  std::uniform_real_distribution<double> chance(0.0, 1.0);
  std::vector<CutNode> nodes(60 + static_cast<std::size_t>(count(random)));
  double along_m = 50.0 * chance(random);
  double heading = 6.0 * (chance(random) - 0.5);
  double density = 3.0;
  for (CutNode& node : nodes) {
    along_m += step_m(random);
    if (chance(random) < 0.15) heading += 2.0 * (chance(random) - 0.5);
    if (chance(random) < 0.1) density = 8.0 * chance(random);
    node.along_m = along_m;
    if (chance(random) < 0.1) continue;
    node.heading_rad = std::remainder(heading, 2.0 * std::numbers::pi);
    node.scans = 1 + static_cast<std::uint32_t>(count(random));
    node.landmarks = static_cast<std::uint32_t>(2.0 * density * chance(random));
    node.new_landmarks = node.landmarks / 2;
    node.is_tied = chance(random) > 0.02;
  }
  return nodes;
}

/// The numbers of landmarks of every scan up to a node, one by one.
std::vector<double> samples_up_to(const std::vector<CutNode>& nodes, std::size_t last) {
  std::vector<double> samples;
  for (std::size_t i = 0; i <= last; ++i)
    for (std::uint32_t k = 0; k < nodes[i].scans; ++k) samples.push_back(nodes[i].landmarks);
  return samples;
}

bool has_mean(const std::vector<CutNode>& nodes, std::size_t last, double below, double above) {
  const std::vector<double> samples = samples_up_to(nodes, last);
  if (samples.empty()) return false;
  const std::size_t counted = std::min<std::size_t>(samples.size(), 16);
  double sum = 0.0;
  for (std::size_t i = samples.size() - counted; i < samples.size(); ++i) sum += samples[i];
  const double mean = sum / static_cast<double>(counted);
  return mean < below || mean > above;
}

bool has_turned(const std::vector<CutNode>& nodes, std::size_t last, double least_rad) {
  for (std::size_t i = 0; i < last; ++i) {
    if (nodes[i].scans == 0 || nodes[last].along_m - nodes[i].along_m > 15.0) continue;
    // The oldest one that is near enough.
    const double turn =
        std::remainder(nodes[last].heading_rad - nodes[i].heading_rad, 2.0 * std::numbers::pi);
    return std::abs(turn) >= least_rad;
  }
  return false;
}

std::size_t size_of(const std::vector<CutNode>& nodes, std::size_t end) {
  std::size_t size = end;
  for (std::size_t i = 0; i < end; ++i) size += nodes[i].new_landmarks;
  return size;
}

/// The definition: the first number of nodes, at least four, with which the stretch may end, or
/// after which there is a gap.
std::optional<std::size_t> by_definition(const std::vector<CutNode>& nodes,
                                         const CutPolicy& policy) {
  for (std::size_t end = 1; end < nodes.size(); ++end) {
    if (!nodes[end].is_tied) return end;
    if (end < 4) continue;
    const double length_m = nodes[end].along_m - nodes[0].along_m;
    const bool is_full = policy.size > 0 && size_of(nodes, end) >= policy.size;
    const bool is_long = length_m >= policy.distance_m;
    const bool waits = policy.sparse > 0.0 || policy.dense > 0.0 || policy.turn_rad > 0.0;
    const bool is_there = !waits || length_m >= policy.longest_m ||
                          (policy.sparse > 0.0 && has_mean(nodes, end - 1, policy.sparse, 1e9)) ||
                          (policy.dense > 0.0 && has_mean(nodes, end - 1, -1.0, policy.dense)) ||
                          (policy.turn_rad > 0.0 && has_turned(nodes, end - 1, policy.turn_rad));
    if (is_full || (is_long && is_there)) return end;
  }
  return std::nullopt;
}

/// How often stretches ended at all, over random paths.
int ended(const CutPolicy& policy) {
  std::mt19937_64 random(31);
  int count = 0;
  for (int i = 0; i < 400; ++i) {
    const std::vector<CutNode> nodes = random_path(random);
    const auto found = first_stretch(nodes, policy);
    REQUIRE(found == by_definition(nodes, policy));
    if (found) ++count;
  }
  return count;
}

CutPolicy policy_of(double distance_m) {
  CutPolicy policy;
  policy.distance_m = distance_m;
  policy.longest_m = 90.0;
  return policy;
}

}  // namespace

TEST_CASE("A stretch ends where its policy says", "[mapper]") {
  CHECK(ended(policy_of(20.0)) == 400);
  CutPolicy sparse = policy_of(20.0);
  CutPolicy dense = sparse;
  CutPolicy turn = sparse;
  CutPolicy size = policy_of(60.0);
  CutPolicy all = sparse;
  sparse.sparse = all.sparse = 1.5;
  dense.dense = all.dense = 5.0;
  turn.turn_rad = all.turn_rad = 0.8;
  size.size = 60;
  for (const CutPolicy& policy : {sparse, dense, turn, size, all}) CHECK(ended(policy) > 300);
  sparse.longest_m = 1e9;  // Some paths never come to where landmarks are few.
  CHECK(ended(sparse) < 400);
}

TEST_CASE("A policy that waits cuts no earlier than the distance alone", "[mapper]") {
  std::mt19937_64 random(7);
  CutPolicy dense = policy_of(25.0);
  dense.dense = 4.0;
  for (int i = 0; i < 200; ++i) {
    const std::vector<CutNode> nodes = random_path(random);
    const auto plain = first_stretch(nodes, policy_of(25.0));
    const auto waiting = first_stretch(nodes, dense);
    REQUIRE((!waiting || *waiting >= *plain));
    // What comes after the stretch's end does not matter.
    if (plain) {
      const auto part = std::span<const CutNode>(nodes).first(*plain + 1);
      REQUIRE(first_stretch(part, policy_of(25.0)) == plain);
    }
  }
}

TEST_CASE("Nothing is cut before four nodes and the next one are there", "[mapper]") {
  std::vector<CutNode> nodes(4);
  for (std::size_t i = 0; i < nodes.size(); ++i) nodes[i].along_m = 100.0 * static_cast<double>(i);
  CHECK_FALSE(first_stretch(nodes, policy_of(10.0)));
  CHECK_FALSE(first_stretch({}, policy_of(10.0)));
  nodes.push_back({400.0, 0.0, 1, 1, 1});
  CHECK(first_stretch(nodes, policy_of(10.0)) == 4u);
}

TEST_CASE("The parameters give the policy", "[mapper]") {
  SmoothingMapperParameters parameters;
  const CutPolicy standard = cut_policy(parameters, 30.0);
  CHECK(standard.distance_m == 15.0);  // Half of the sensor's range.
  CHECK(standard.sparse + standard.dense + standard.turn_rad == 0.0);
  CHECK(standard.size == 0u);
  parameters.cut_longest_m = 1.0;
  CHECK(cut_policy(parameters, 100.0).longest_m == 20.0);
}
