// The channels of a service, declared in one place: --help, the diagram of services/README.md and
// the check of what an adapter binds all follow from it.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace understory::bus {

/// Direction of a channel, as its service sees it.
enum class Flow : std::uint8_t { kIn, kOut };

/// One channel that a service subscribes (kIn) or publishes (kOut).
struct ChannelUse {
  Flow flow = Flow::kIn;
  std::string channel;
  std::string text;          ///< One line for people: its content.
  bool is_optional = false;  ///< A parameter decides; `text` names it.
};

/// What an adapter has bound: a direction and a name without suffix.
struct BoundChannel {
  Flow flow = Flow::kIn;
  std::string channel;
};

/// Filled by the struct that names a service's channels, while that struct is made:
///   struct EkfChannels {
///     bus::ChannelList all;
///     std::string odometry = all.in("ODOMETRY", "motion without landmarks");
///     std::string pose = all.out("EKF_POSE", "pose, velocity, biases");
///   };
class ChannelList {
 public:
  /// Nothing but channels.
  ChannelList() = default;
  /// `source` and `sink`: what the service reads or gives beside the bus (a socket, a web page).
  explicit ChannelList(std::string source, std::string sink = "")
      : source_(std::move(source)), sink_(std::move(sink)) {}

  /// A channel that is always subscribed; returns its name.
  std::string in(const std::string& channel, const std::string& text);
  /// A channel that is subscribed where a parameter says so; returns its name.
  std::string in_if(const std::string& channel, const std::string& text);
  /// A channel that is published; returns its name.
  std::string out(const std::string& channel, const std::string& text);
  /// Gives a channel another name, in the list and in `channel`, a member that in() or out() made.
  void rename(std::string& channel, const std::string& name);

  /// The channels, in the order of declaration.
  const std::vector<ChannelUse>& uses() const { return uses_; }
  /// One line, e.g. "LANDMARKS, ODOMETRY -> KEYFRAME".
  std::string summary() const;
  /// A paragraph of --help, one line for each channel.
  std::string help() const;
  /// How `bound` differs from the list, in one line; empty = it does not.
  std::string difference(const std::vector<BoundChannel>& bound) const;

 private:
  std::string source_;
  std::string sink_;
  std::vector<ChannelUse> uses_;
};

}  // namespace understory::bus
