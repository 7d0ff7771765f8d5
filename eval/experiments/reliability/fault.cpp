#include "eval/experiments/reliability/fault.hpp"

#include <stdexcept>

namespace understory::eval::experiments::reliability {
namespace {

std::vector<Fault> kinds_of(const DelayPlan& plan) {
  const std::vector<std::string> sensors = {"RAW_IMU", "RAW_WHEELS", "RAW_SWEEP"};
  std::vector<Fault> kinds = {
      {.what = "all sensors held", .held_channels = sensors},
      {.what = "all processes stopped", .stopped_processes = plan.processes}};
  for (const std::string& one : sensors)
    kinds.push_back({.what = one + " held", .held_channels = {one}});
  for (const std::string& one : plan.processes)
    kinds.push_back({.what = one + " stopped", .stopped_processes = {one}});
  std::erase_if(
      kinds, [&](const Fault& fault) { return fault.what.find(plan.only) == std::string::npos; });
  if (kinds.empty()) throw std::invalid_argument("--only: no delay has this in its name");
  return kinds;
}

}  // namespace

std::vector<Fault> draw_delays(const DelayPlan& plan, std::size_t count, std::mt19937_64& random) {
  const std::vector<Fault> kinds = kinds_of(plan);
  std::uniform_real_distribution<double> lasts_s(0.0, plan.longest_s);
  std::uniform_int_distribution<std::size_t> kind(0, kinds.size() - 1);
  std::vector<Fault> faults;
  double at_s = plan.from_s;
  for (std::size_t i = 0; i < count; ++i) {
    faults.push_back(kinds[kind(random)]);
    faults.back().from_s = at_s;
    faults.back().to_s = at_s + lasts_s(random);
    at_s = faults.back().to_s + kApart_s;
  }
  return faults;
}

}  // namespace understory::eval::experiments::reliability
