#include "eval/experiments/partition/recorded_drive.hpp"

#include <stdexcept>

#include "common/io/lcm_log.hpp"
#include "common/wire/convert.hpp"
#include "understory/ground_truth_t.hpp"

namespace understory::eval::experiments::partition {
namespace {

constexpr const char* kKeyframe = "KEYFRAME";
constexpr const char* kOdometry = "ODOMETRY";
constexpr const char* kRestLevel = "REST_LEVEL";
constexpr const char* kEkfPose = "EKF_POSE";
constexpr const char* kEkfLevel = "EKF_LEVEL";
constexpr const char* kTruth = "GROUND_TRUTH";

const char* channel_of(const MapperInput& input) {
  constexpr const char* kChannels[] = {kOdometry, kRestLevel, kEkfPose, kEkfLevel, kKeyframe};
  return kChannels[input.index()];
}

model::Utime utime_of(const MapperInput& input) {
  return std::visit([](const auto& one) { return one.utime; }, input);
}

template <class T>
T decoded(const io::LogEvent& event, const std::filesystem::path& log) {
  const auto value = wire::decode_message<T>(event.data);
  if (!value)
    throw std::runtime_error(log.string() + ": " + event.channel + ": a message is damaged");
  return *value;
}

}  // namespace

double RecordedDrive::length_m() const {
  double sum_m = 0.0;
  for (std::size_t i = 1; i < truth.size(); ++i)
    sum_m += (truth[i].pose.translation() - truth[i - 1].pose.translation()).norm();
  return sum_m;
}

RecordedDrive RecordedDrive::first(double along_m) const {
  RecordedDrive result;
  double sum_m = 0.0;
  for (const metrics::StampedPose& one : truth) {
    if (!result.truth.empty())
      sum_m += (one.pose.translation() - result.truth.back().pose.translation()).norm();
    if (sum_m > along_m) break;
    result.truth.push_back(one);
  }
  if (result.truth.empty()) return result;

  for (const MapperInput& input : inputs)
    if (utime_of(input) <= result.truth.back().utime) result.inputs.push_back(input);
  return result;
}

RecordedDrive record(Route& route) {
  RecordedDrive drive;
  for (std::size_t k = 0; k < route.size(); ++k) {
    if (k > 0) drive.inputs.emplace_back(route.odometry(k));
    model::Keyframe keyframe = route.keyframe(k);
    drive.truth.push_back({keyframe.utime, route.pose(k)});
    drive.inputs.emplace_back(std::move(keyframe));
  }
  return drive;
}

void save(const RecordedDrive& drive, const std::filesystem::path& log) {
  io::LcmLogWriter writer(log);
  std::int64_t sequence = 0;
  for (const metrics::StampedPose& one : drive.truth) {
    ground_truth_t truth{};
    truth.utime = one.utime;
    truth.seq = sequence++;
    truth.world_T_vehicle = wire::to_wire(one.pose);
    writer.write(one.utime, kTruth, wire::encode_message(truth));
  }
  for (const MapperInput& input : drive.inputs) {
    std::visit(
        [&](const auto& one) {
          writer.write(one.utime, channel_of(input), wire::encode_message(one));
        },
        input);
  }
  writer.commit();
}

RecordedDrive load(const std::filesystem::path& log) {
  io::LcmLogReader reader(log);
  RecordedDrive drive;

  while (const auto event = reader.next()) {
    if (event->channel == kTruth) {
      const auto truth = decoded<ground_truth_t>(*event, log);
      drive.truth.push_back({truth.utime, wire::from_wire(truth.world_T_vehicle)});
    } else if (event->channel == kKeyframe) {
      drive.inputs.emplace_back(decoded<model::Keyframe>(*event, log));
    } else if (event->channel == kOdometry) {
      drive.inputs.emplace_back(decoded<model::Odometry>(*event, log));
    } else if (event->channel == kRestLevel) {
      drive.inputs.emplace_back(decoded<model::RestLevel>(*event, log));
    } else if (event->channel == kEkfPose) {
      drive.inputs.emplace_back(decoded<model::EkfPose>(*event, log));
    } else if (event->channel == kEkfLevel) {
      drive.inputs.emplace_back(decoded<model::EkfLevel>(*event, log));
    }
  }

  reader.refuse_other_files();
  return drive;
}

}  // namespace understory::eval::experiments::partition
