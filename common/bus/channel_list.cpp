#include "common/bus/channel_list.hpp"

#include <algorithm>

namespace understory::bus {
namespace {

void join(std::string& list, const std::string& name) {
  if (!name.empty()) list += (list.empty() ? "" : ", ") + name;
}

std::string padded(std::string text, std::size_t width) {
  text.resize(std::max(width, text.size()), ' ');
  return text;
}

const char* name_of(Flow flow) { return flow == Flow::kIn ? "in" : "out"; }

}  // namespace

std::string ChannelList::in(const std::string& channel, const std::string& text) {
  uses_.push_back({Flow::kIn, channel, text, false});
  return channel;
}

std::string ChannelList::in_if(const std::string& channel, const std::string& text) {
  uses_.push_back({Flow::kIn, channel, text, true});
  return channel;
}

std::string ChannelList::out(const std::string& channel, const std::string& text) {
  uses_.push_back({Flow::kOut, channel, text, false});
  return channel;
}

void ChannelList::rename(std::string& channel, const std::string& name) {
  for (ChannelUse& use : uses_) {
    if (use.channel == channel) use.channel = name;
  }
  channel = name;
}

std::string ChannelList::summary() const {
  std::string in = source_;
  std::string out;
  for (const ChannelUse& use : uses_) join(use.flow == Flow::kIn ? in : out, use.channel);
  join(out, sink_);
  return in + " -> " + out;
}

std::string ChannelList::help() const {
  std::size_t width = 0;
  for (const ChannelUse& use : uses_) width = std::max(width, use.channel.size());

  std::string text = "Channels:\n";
  if (!source_.empty()) text += "  in   " + source_ + "\n";
  for (const ChannelUse& use : uses_) {
    text += "  " + padded(name_of(use.flow), 5) + padded(use.channel, width + 2) + use.text + "\n";
  }
  if (!sink_.empty()) text += "  out  " + sink_ + "\n";
  return text + "  out  HEALTH, LOG, CONFIG, as every process\n";
}

std::string ChannelList::difference(const std::vector<BoundChannel>& bound) const {
  std::string text;
  for (const ChannelUse& use : uses_) {
    const bool is_bound = std::ranges::any_of(bound, [&](const BoundChannel& one) {
      return one.flow == use.flow && one.channel == use.channel;
    });
    if (!is_bound && !use.is_optional)
      join(text, use.channel + " (" + name_of(use.flow) + ") is declared and not bound");
  }

  for (const BoundChannel& one : bound) {
    const bool is_declared = std::ranges::any_of(uses_, [&](const ChannelUse& use) {
      return one.flow == use.flow && one.channel == use.channel;
    });
    if (!is_declared)
      join(text, one.channel + " (" + name_of(one.flow) + ") is bound and not declared");
  }
  return text;
}

}  // namespace understory::bus
