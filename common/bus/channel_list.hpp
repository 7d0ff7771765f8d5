// The channels of a service, declared in one place: --help, the diagram of services/README.md and
// the check of an adapter's channels follow from it.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace understory::bus {

/// Direction of a channel, seen from its service.
enum class Flow : std::uint8_t { kIn, kOut };

/// One channel that a service subscribes (kIn) or publishes (kOut).
struct ChannelUse {
  Flow flow = Flow::kIn;
  std::string channel;
  std::string text;          ///< One line for people: its content.
  bool is_optional = false;  ///< A parameter turns it on; `text` names the parameter.
};

/// A channel that an adapter has bound: direction, and name without suffix.
struct BoundChannel {
  Flow flow = Flow::kIn;
  std::string channel;
};

/// The struct with a service's channel names fills it in its initialisers:
///   struct EkfChannels {
///     bus::ChannelList all;
///     std::string odometry = all.in("ODOMETRY", "motion without landmarks");
///     std::string pose = all.out("EKF_POSE", "pose, velocity, biases");
///   };
class ChannelList {
 public:
  /// A service without input or output beside the bus.
  ChannelList() = default;
  /// `source` and `sink`: the service's input and output beside the bus (a socket, a web page).
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
  /// The difference between `bound` and the list, in one line; empty = none.
  std::string difference(const std::vector<BoundChannel>& bound) const;

 private:
  std::string source_;
  std::string sink_;
  std::vector<ChannelUse> uses_;
};

}  // namespace understory::bus
