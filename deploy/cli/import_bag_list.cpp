#include "deploy/cli/import_bag_list.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/terminal/printable.hpp"

namespace understory::cli {
namespace {

constexpr double kClockApart_s = 0.5;
using Row = std::array<std::string, 7>;

std::string number(double value, const char* format) {
  return fmt::format(fmt::runtime(format), value);
}

void print_rows(const std::vector<Row>& rows) {
  std::array<std::size_t, 7> width{};
  for (const Row& row : rows) {
    for (std::size_t c = 0; c < row.size(); ++c) width[c] = std::max(width[c], row[c].size());
  }
  for (const Row& row : rows) {
    std::string line;
    for (std::size_t c = 0; c < row.size(); ++c) {
      const bool is_number = c == 2 || c == 3 || c == 5;
      line += is_number ? fmt::format("{:>{}}  ", row[c], width[c])
                        : fmt::format("{:<{}}  ", row[c], width[c]);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    fmt::print("{}\n", line);
  }
}

Row row_of(const bag::Topic& topic, const bag::TopicSurvey& found, const std::string& use) {
  Row row{terminal::printable(topic.name), terminal::printable(topic.type), "", "", "", "", use};
  const std::uint64_t messages = std::max(found.messages, topic.messages.value_or(0));
  row[2] = std::to_string(messages);
  if (found.messages == 0) return row;
  row[3] = found.rate_hz() > 0.0 ? number(found.rate_hz(), "{:.2f}") : "";
  row[4] = terminal::printable(found.frame);
  if (role_of(topic) != bag::Role::kTransforms)
    row[5] = found.without_stamp == found.messages
                 ? "no stamp"
                 : number(found.stamp_minus_received_s, "{:+.3f}");
  return row;
}

void print_span(const bag::Survey& survey) {
  std::int64_t first = 0;
  std::int64_t last = 0;
  for (const bag::TopicSurvey& topic : survey.topics) {
    if (topic.messages == 0) continue;
    first = first == 0 ? topic.first_ns : std::min(first, topic.first_ns);
    last = std::max(last, topic.last_ns);
  }
  if (last == 0) return;
  fmt::print(", {:.1f} s from {:%Y-%m-%d %H:%M:%S} UTC",
             1e-9 * (static_cast<double>(last) - static_cast<double>(first)),
             fmt::gmtime(static_cast<std::time_t>(first / 1'000'000'000)));
}

/// The force at the beginning, and what is odd about it: at rest it is gravity's, upwards.
std::string force_text(const bag::TopicSurvey& imu, const BagMounts& mounts) {
  constexpr double kGravity = 9.81;
  const Eigen::Vector3d& force = imu.force_mps2;
  std::string text = fmt::format("force at the beginning ({:.2f}, {:.2f}, {:.2f})", force.x(),
                                 force.y(), force.z());
  const double size = force.norm();
  if (std::abs(size - 1.0) < 0.2) {
    text += ": in g, which lidar_imu_input converts";
  } else if (size < 0.5 * kGravity) {
    text += " m/s^2: gravity is missing";
  } else {
    text += " m/s^2";
  }

  const auto mount = mounts.find(imu.frame);
  if (mount && size > 0.5 && (mount->linear() * force).z() < -0.5 * size)
    text +=
        "; it points down in the vehicle: an IMU upside down, or a driver that turned its sign "
        "round";
  if (mount && size > 0.5 && std::abs((mount->linear() * force).z()) < 0.5 * size)
    text += "; it points sideways in the vehicle: another mount than the transforms say";
  return text;
}

void print_mounts(const bag::Bag& bag, const bag::Survey& survey, const BagMounts& mounts) {
  std::vector<std::string> frames;
  for (std::size_t i = 0; i < bag.topics().size(); ++i) {
    const bag::Role role = role_of(bag.topics()[i]);
    const bool is_sensor =
        role == bag::Role::kCloud || role == bag::Role::kScan || role == bag::Role::kImu;
    const std::string& frame = survey.topics[i].frame;
    if (is_sensor && survey.topics[i].messages > 0 &&
        std::ranges::find(frames, frame) == frames.end())
      frames.push_back(frame);
  }

  for (const std::string& frame : frames) {
    const auto mount = mounts.find(frame);
    if (!mount) {
      fmt::print("mount: {}\n", terminal::printable(mounts.missing(frame)));
      continue;
    }
    const Eigen::Vector3d p = mount->translation();
    const Eigen::Quaterniond q(mount->linear());
    fmt::print("mount: {} on {}: x {:.3f} y {:.3f} z {:.3f} m, rotated by {:.2f} degrees\n",
               terminal::printable(frame), terminal::printable(mounts.base()), p.x(), p.y(), p.z(),
               2.0 * std::atan2(q.vec().norm(), std::abs(q.w())) * 180.0 / M_PI);
  }
}

}  // namespace

std::vector<std::string> clock_remarks(const bag::Bag& bag, const bag::Survey& survey,
                                       const std::vector<std::size_t>& chosen) {
  std::vector<std::string> lines;
  std::vector<std::size_t> stamped;
  std::vector<double> offsets;
  for (const std::size_t topic : chosen) {
    const bag::TopicSurvey& found = survey.topics[topic];
    if (found.without_stamp > 0)
      lines.push_back(fmt::format(
          "{0}: the stamp of {1} of {2} messages is 0: --receive-time {0} takes the time of "
          "reception",
          bag.topics()[topic].name, found.without_stamp, found.messages));
    if (found.without_stamp == found.messages) continue;
    stamped.push_back(topic);
    offsets.push_back(found.stamp_minus_received_s);
  }
  if (offsets.empty()) return lines;
  // The clock nearest to the recorder's is the one to which the others are compared.
  const double reference =
      *std::ranges::min_element(offsets, {}, [](double offset) { return std::abs(offset); });

  for (std::size_t i = 0; i < stamped.size(); ++i) {
    if (std::abs(offsets[i] - reference) < kClockApart_s) continue;
    const std::string& name = bag.topics()[stamped[i]].name;
    lines.push_back(fmt::format(
        "{}: its stamps are {:+.3f} s from the time of reception, those of others {:+.3f} s: "
        "--receive-time {} lays them onto the recorder's clock",
        name, offsets[i], reference, name));
  }
  return lines;
}

void print_bag_list(const std::string& path, const bag::Bag& bag, const bag::Survey& survey,
                    const BagTopics& named, const BagMounts& mounts) {
  fmt::print("{}: {}", path, bag.kind());
  print_span(survey);
  fmt::print("\n\n");

  const std::vector<std::string> uses = bag_uses(bag.topics(), named);
  std::vector<Row> rows{
      {"topic", "type", "messages", "Hz", "frame", "stamp - received [s]", "imported as"}};
  for (std::size_t i = 0; i < bag.topics().size(); ++i)
    rows.push_back(row_of(bag.topics()[i], survey.topics[i], uses[i]));
  std::sort(rows.begin() + 1, rows.end());
  print_rows(rows);
  fmt::print("\n");

  std::vector<std::size_t> sensors;
  for (std::size_t i = 0; i < bag.topics().size(); ++i) {
    const bag::TopicSurvey& found = survey.topics[i];
    const std::string name = terminal::printable(bag.topics()[i].name);
    if (!found.cloud.empty()) fmt::print("{}: {}\n", name, terminal::printable(found.cloud));
    if (role_of(bag.topics()[i]) == bag::Role::kImu && found.messages > 0 &&
        !bag::is_packet_type(bag.topics()[i].type))
      fmt::print("{}: {}\n", name, force_text(found, mounts));
    if (!found.fault.empty()) fmt::print("{}: {}\n", name, terminal::printable(found.fault));
    if (uses[i].starts_with("RAW_")) sensors.push_back(i);
  }
  print_mounts(bag, survey, mounts);
  for (const std::string& line : survey.transforms.remarks())
    fmt::print("mount: {}\n", terminal::printable(line));
  for (const std::string& line : clock_remarks(bag, survey, sensors))
    fmt::print("clock: {}\n", terminal::printable(line));
  for (const std::string& line : bag.remarks()) fmt::print("{}\n", terminal::printable(line));
}

}  // namespace understory::cli
