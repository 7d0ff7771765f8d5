#include "deploy/cli/import_bag_choice.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "common/io/data_error.hpp"

namespace understory::cli {
namespace {

using bag::Role;

/// An option and what it takes.
struct Slot {
  std::string_view option;
  std::vector<Role> roles;
  bool is_taken_alone;  ///< Without being named, where there is no other.
  std::string BagTopics::*name;
  std::optional<std::size_t> BagChoice::*choice;
  std::string_view channel;
  std::string_view types;
};

const std::vector<Slot>& slots() {
  static const std::vector<Slot> kSlots{
      {"cloud",
       {Role::kCloud},
       true,
       &BagTopics::cloud,
       &BagChoice::cloud,
       "RAW_SWEEP",
       "PointCloud2, Livox CustomMsg or packets of a laser"},
      {"scan", {Role::kScan}, true, &BagTopics::scan, &BagChoice::scan, "RAW_SCAN", "LaserScan"},
      {"imu", {Role::kImu}, true, &BagTopics::imu, &BagChoice::imu, "RAW_IMU", "Imu"},
      {"odometry",
       {Role::kOdometry, Role::kTwist},
       false,
       &BagTopics::odometry,
       &BagChoice::odometry,
       "RAW_WHEELS",
       "Odometry, TwistStamped or TwistWithCovarianceStamped"},
      {"gnss", {Role::kGnss}, true, &BagTopics::gnss, &BagChoice::gnss, "RAW_GNSS", "NavSatFix"},
      {"truth",
       {Role::kPose, Role::kOdometry},
       false,
       &BagTopics::truth,
       &BagChoice::truth,
       "GROUND_TRUTH",
       "PoseStamped, PoseWithCovarianceStamped, TransformStamped or Odometry"}};
  return kSlots;
}

bool fits(const Slot& slot, const bag::Topic& topic) {
  return std::ranges::find(slot.roles, role_of(topic)) != slot.roles.end();
}

std::vector<std::size_t> candidates(const Slot& slot, const std::vector<bag::Topic>& topics) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < topics.size(); ++i) {
    if (fits(slot, topics[i]) && topics[i].messages.value_or(1) > 0) found.push_back(i);
  }
  return found;
}

std::string names(const std::vector<std::size_t>& list, const std::vector<bag::Topic>& topics) {
  std::vector<std::string> text;
  text.reserve(list.size());
  for (const std::size_t i : list)
    text.push_back(fmt::format("{} ({}, {} messages)", topics[i].name, topics[i].type,
                               topics[i].messages.value_or(0)));
  return text.empty() ? "none" : fmt::format("{}", fmt::join(text, ", "));
}

std::size_t named_topic(const Slot& slot, const std::string& name,
                        const std::vector<bag::Topic>& topics) {
  std::vector<std::size_t> same;
  for (std::size_t i = 0; i < topics.size(); ++i) {
    if (topics[i].name == name && fits(slot, topics[i])) same.push_back(i);
  }
  if (same.size() == 1) return same.front();

  const auto other = std::ranges::find(topics, name, &bag::Topic::name);
  const std::string candidates_text = names(candidates(slot, topics), topics);
  if (other == topics.end())
    throw io::DataError(
        fmt::format("--{} {}: no such topic; there are: {}", slot.option, name, candidates_text));
  throw io::DataError(fmt::format(
      "--{} {}: its type is {} in encoding '{}'; {} is wanted; there are: {}", slot.option, name,
      other->type, other->encoding_name, slot.types, candidates_text));
}

/// The topic for a slot; none = nothing is imported for it.
std::optional<std::size_t> choose(const Slot& slot, const std::string& name,
                                  const std::vector<bag::Topic>& topics) {
  if (name == "none") return std::nullopt;
  if (!name.empty()) return named_topic(slot, name, topics);
  const auto list = candidates(slot, topics);
  if (!slot.is_taken_alone || list.empty()) return std::nullopt;
  if (list.size() == 1) return list.front();
  throw io::DataError(fmt::format("which one is --{}: {}? (--{} none imports none)", slot.option,
                                  names(list, topics), slot.option));
}

/// The same, but none of several.
std::optional<std::size_t> choice_or_none(const Slot& slot, const std::string& name,
                                          const std::vector<bag::Topic>& topics) {
  try {
    return choose(slot, name, topics);
  } catch (const io::DataError&) {
    return std::nullopt;
  }
}

}  // namespace

std::vector<std::size_t> BagChoice::all() const {
  std::vector<std::size_t> list;
  for (const auto& choice : {cloud, scan, imu, odometry, gnss, truth}) {
    if (choice && std::ranges::find(list, *choice) == list.end()) list.push_back(*choice);
  }
  return list;
}

BagChoice choose_bag_topics(const std::vector<bag::Topic>& topics, const BagTopics& named) {
  BagChoice choice;
  for (const Slot& slot : slots()) {
    const bool is_scan_beside_cloud =
        slot.option == "scan" && named.scan.empty() && choice.cloud.has_value();
    if (!is_scan_beside_cloud) choice.*slot.choice = choose(slot, named.*slot.name, topics);
    if (choice.*slot.choice || !(named.*slot.name).empty()) continue;
    const auto list = candidates(slot, topics);
    if (!list.empty())
      choice.remarks.push_back(fmt::format("not imported as {} unless named: --{}, of {}",
                                           slot.channel, slot.option, names(list, topics)));
  }
  if (choice.cloud && choice.scan)
    throw io::DataError("--cloud and --scan: a laser in space or one in a plane, not both");
  return choice;
}

std::vector<std::string> bag_uses(const std::vector<bag::Topic>& topics, const BagTopics& named) {
  std::vector<std::string> uses(topics.size());
  std::optional<std::size_t> cloud;
  for (const Slot& slot : slots()) {
    const std::string& name = named.*slot.name;
    const bool is_beside_cloud = slot.option == "scan" && name.empty() && cloud;
    const auto taken = is_beside_cloud ? std::nullopt : choice_or_none(slot, name, topics);
    if (slot.option == "cloud") cloud = taken;

    for (const std::size_t i : candidates(slot, topics)) {
      if (taken && taken != i) continue;
      const std::string use =
          taken ? std::string(slot.channel) : fmt::format("--{} {}", slot.option, topics[i].name);
      uses[i] = uses[i].empty() ? use : fmt::format("{} or {}", uses[i], use);
    }
  }

  for (std::size_t i = 0; i < topics.size(); ++i) {
    if (role_of(topics[i]) == Role::kTransforms) uses[i] = "mounts";
    if (topics[i].encoding == bag::Encoding::kOther)
      uses[i] = fmt::format("encoding '{}' is not read", topics[i].encoding_name);
    if (uses[i].empty()) uses[i].assign(1, '-');
  }
  return uses;
}

}  // namespace understory::cli
