#include "eval/harness/slam_session.hpp"

#include <utility>

#include "eval/tools/thread_clock.hpp"

namespace understory::eval::harness {

SlamSession::SlamSession(Stages stages) : stages_(std::move(stages)) {}

std::optional<KeyframeOutcome> SlamSession::feed(const model::LandmarkScan& scan) {
  const std::uint64_t withheld_before = stages_.keyframer.withheld();
  const double start_s = tools::thread_time_s();
  std::optional<model::Keyframe> keyframe = stages_.keyframer.add(scan);
  keyframer_s_ += tools::thread_time_s() - start_s;
  withheld_one_ = stages_.keyframer.withheld() > withheld_before;
  for (const model::Keyframe& waited : stages_.keyframer.take_waited()) {
    (void)stages_.mapper.add(waited);
  }
  if (!keyframe) return std::nullopt;
  const double mapping_start_s = tools::thread_time_s();
  model::MapUpdate update = stages_.mapper.add(*keyframe);
  const double mapper_s = tools::thread_time_s() - mapping_start_s;
  return KeyframeOutcome{std::move(*keyframe), std::move(update), std::exchange(keyframer_s_, 0.0),
                         mapper_s};
}

}  // namespace understory::eval::harness
