#include "eval/harness/slam_session.hpp"

#include <chrono>
#include <utility>

namespace understory::eval::harness {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace

SlamSession::SlamSession(Stages stages) : stages_(std::move(stages)) {}

std::optional<KeyframeOutcome> SlamSession::feed(const model::LandmarkScan& scan) {
  const std::uint64_t withheld_before = stages_.keyframer->counters().keyframes_withheld;
  const auto start = Clock::now();
  std::optional<model::Keyframe> keyframe = stages_.keyframer->add(scan);
  keyframer_s_ += seconds_since(start);
  withheld_one_ = stages_.keyframer->counters().keyframes_withheld > withheld_before;
  if (!keyframe) return std::nullopt;
  const auto mapping_start = Clock::now();
  model::MapUpdate update = stages_.mapper->add(*keyframe);
  const double mapper_s = seconds_since(mapping_start);
  return KeyframeOutcome{std::move(*keyframe), std::move(update), std::exchange(keyframer_s_, 0.0),
                         mapper_s};
}

}  // namespace understory::eval::harness
