// make_stages of eval/harness/slam_session.hpp.
#include <memory>
#include <stdexcept>

#include "eval/baselines/keyframer/keyframer.hpp"
#include "eval/baselines/mapper/mapper.hpp"
#include "eval/harness/slam_session.hpp"
#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "services/keyframer/joint/joint_keyframer.hpp"

namespace understory::eval::harness {
namespace {

/// The method of the vehicle.
Stages own_stages(double hand_over_m) {
  geoslam_mapper::SmoothingMapperParameters parameters;
  parameters.hand_over_m = hand_over_m;
  const auto keyframer =
      std::make_shared<keyframer::joint::JointKeyframer>(keyframer::JointKeyframerParameters{});
  const auto mapper = std::make_shared<geoslam_mapper::smoothing::SmoothingMapper>(parameters);
  return {{[=](const model::LandmarkScan& scan) { return keyframer->add(scan); },
           [=] { return keyframer->take_waited(); },
           [=] { return keyframer->counters().keyframes_withheld; }},
          {[=](const model::Keyframe& keyframe) { return mapper->add(keyframe); },
           [=] { return mapper->trajectory(); }, [=] { return mapper->landmarks(); },
           [=](SubmapShelf& shelf) { shelf.serve(*mapper); }}};
}

/// The thesis's method gives out every keyframe at once and keeps its whole map.
Stages baseline_stages() {
  const auto keyframer =
      std::make_shared<baselines::keyframer::Keyframer>(baselines::keyframer::Parameters{});
  const auto mapper = std::make_shared<baselines::mapper::Mapper>(baselines::mapper::Parameters{});
  return {{[=](const model::LandmarkScan& scan) { return keyframer->add(scan); },
           [] { return std::vector<model::Keyframe>(); }, [] { return std::uint64_t{0}; }},
          {[=](const model::Keyframe& keyframe) { return mapper->add(keyframe); },
           [=] { return mapper->trajectory(); }, [=] { return mapper->landmarks(); },
           [](SubmapShelf& /*shelf*/) {}}};
}

}  // namespace

Stages make_stages(std::string_view method, double hand_over_m) {
  if (method == "baseline") return baseline_stages();
  if (method == "smoothing") return own_stages(hand_over_m);
  throw std::invalid_argument("unknown method '" + std::string(method) + "'");
}

}  // namespace understory::eval::harness
