#include "common/bag/survey.hpp"

#include <algorithm>
#include <map>

#include "common/io/data_error.hpp"

namespace understory::bag {
namespace {

/// Frame for Ouster's packets; their messages have none.
constexpr const char* kOusterFrame = "os_sensor";
constexpr std::uint64_t kCloudsLookedInto = 3;
constexpr std::uint64_t kForcesLookedAt = 100;
/// Largest number of stored clock differences: beyond it every second one is dropped, repeatedly.
constexpr std::size_t kMostDifferences = 4096;

/// Differences between stamp and reception time, thinned evenly.
class Differences {
 public:
  void add(std::int64_t difference_ns) {
    if (seen_++ % step_ != 0) return;
    kept_.push_back(difference_ns);
    if (kept_.size() < kMostDifferences) return;
    for (std::size_t i = 0; 2 * i < kept_.size(); ++i) kept_[i] = kept_[2 * i];
    kept_.resize(kept_.size() / 2);
    step_ *= 2;
  }
  double median_s() {
    if (kept_.empty()) return 0.0;
    const auto middle = kept_.begin() + static_cast<std::ptrdiff_t>(kept_.size() / 2);
    std::ranges::nth_element(kept_, middle);
    return 1e-9 * static_cast<double>(*middle);
  }

 private:
  std::vector<std::int64_t> kept_;
  std::uint64_t seen_ = 0;
  std::uint64_t step_ = 1;
};

bool is_static(const Topic& topic) { return topic.name.ends_with("tf_static"); }

/// Intermediate values of one topic beside its survey.
struct Gathered {
  Differences differences;
  CloudDecoder decoder;
};

void look_into_cloud(MessageReader reader, const std::string& type, CloudDecoder& decoder) {
  if (type == "sensor_msgs/PointCloud2") {
    decoder.decode(read_point_cloud(reader));
  } else if (type.ends_with("/CustomMsg")) {
    decoder.decode(read_livox_cloud(reader));
  }
}

void look_into(const Bag& bag, const Message& message, Survey& survey, TopicSurvey& found,
               Gathered& gathered) {
  const Topic& topic = bag.topics()[message.topic];
  const Role role = role_of(topic);
  MessageReader reader = reader_of(bag, message);
  if (role == Role::kTransforms) {
    for (const Pose& transform : read_transforms(reader)) {
      if (is_static(topic)) {
        survey.transforms.add(transform);
      } else {
        survey.transforms.watch(transform);
      }
    }
    return;
  }

  const bool has_packets = is_packet_type(topic.type);
  const Header header = has_packets ? read_packets(reader, topic.type).header : read_header(reader);
  if (found.messages == 1)
    found.frame = is_ouster_packet_type(topic.type) ? kOusterFrame : header.frame;
  const bool is_stamped = has_stamp(header, message.received_ns);
  if (is_stamped) gathered.differences.add(header.stamp_ns - message.received_ns);
  if (!is_stamped && !has_packets) ++found.without_stamp;
  if (has_packets) return;
  if (role == Role::kImu && found.messages <= kForcesLookedAt) {
    MessageReader again = reader_of(bag, message);
    found.force_mps2 += (read_imu(again).specific_force_mps2 - found.force_mps2) /
                        static_cast<double>(found.messages);
  }
  if (role != Role::kCloud || found.messages > kCloudsLookedInto) return;
  look_into_cloud(reader_of(bag, message), topic.type, gathered.decoder);
  found.cloud = gathered.decoder.description();
}

}  // namespace

Role role_of(const Topic& topic) {
  static const std::map<std::string, Role> kRoles{{"sensor_msgs/PointCloud2", Role::kCloud},
                                                  {"livox_ros_driver/CustomMsg", Role::kCloud},
                                                  {"livox_ros_driver2/CustomMsg", Role::kCloud},
                                                  {"tf2_msgs/TFMessage", Role::kTransforms},
                                                  {"tf/tfMessage", Role::kTransforms},
                                                  {"sensor_msgs/LaserScan", Role::kScan},
                                                  {"sensor_msgs/Imu", Role::kImu},
                                                  {"nav_msgs/Odometry", Role::kOdometry},
                                                  {"sensor_msgs/NavSatFix", Role::kGnss}};
  if (topic.encoding == Encoding::kOther) return Role::kNone;
  const auto role = kRoles.find(topic.type);
  if (role != kRoles.end()) return role->second;
  if (is_ouster_packet_type(topic.type) && topic.name.find("imu") != std::string::npos)
    return Role::kImu;
  if (is_packet_type(topic.type)) return Role::kCloud;
  if (is_twist_type(topic.type)) return Role::kTwist;
  return is_pose_type(topic.type) ? Role::kPose : Role::kNone;
}

double TopicSurvey::rate_hz() const {
  if (messages < 2 || last_ns <= first_ns) return 0.0;
  return static_cast<double>(messages - 1) /
         (1e-9 * (static_cast<double>(last_ns) - static_cast<double>(first_ns)));
}

MessageReader reader_of(const Bag& bag, const Message& message) {
  return {message.data, bag.topics()[message.topic].encoding};
}

Survey survey(Bag& bag, const CloudOptions& options,
              const std::function<void(std::uint64_t)>& progress) {
  Survey result;
  result.topics.resize(bag.topics().size());
  std::vector<std::size_t> wanted;
  for (std::size_t i = 0; i < bag.topics().size(); ++i) {
    if (role_of(bag.topics()[i]) != Role::kNone) wanted.push_back(i);
  }
  if (wanted.empty()) return result;

  std::map<std::size_t, Gathered> gathered;
  for (const std::size_t topic : wanted) gathered[topic].decoder = CloudDecoder(options);
  bag.rewind(wanted);
  std::uint64_t read = 0;

  while (const auto message = bag.next()) {
    TopicSurvey& found = result.topics[message->topic];
    if (found.messages++ == 0) found.first_ns = message->received_ns;
    found.last_ns = message->received_ns;
    try {
      look_into(bag, *message, result, found, gathered[message->topic]);
    } catch (const io::DataError& error) {
      if (found.fault.empty())
        found.fault = "message " + std::to_string(found.messages) + ": " + error.what();
    }
    if (progress) progress(++read);
  }

  result.transforms.take_watched();
  for (auto& [topic, of_topic] : gathered)
    result.topics[topic].stamp_minus_received_s = of_topic.differences.median_s();
  bag.rewind({});
  return result;
}

}  // namespace understory::bag
