#include "tests/bus/faulty_bus.hpp"

#include <algorithm>
#include <utility>

namespace understory::test {

std::optional<wire::Refusal> FaultyBus::publish(std::string_view channel,
                                                std::span<const std::uint8_t> bytes) {
  if (auto refusal = bus::check_publishable(channel, bytes.size())) return refusal;
  const bool is_target =
      plan_.channels.empty() ||
      std::find(plan_.channels.begin(), plan_.channels.end(), channel) != plan_.channels.end();
  std::optional<wire::Refusal> refusal;

  if (is_target) {
    const double chance = std::uniform_real_distribution<double>(0.0, 1.0)(random_);
    refusal = send_damaged(channel, {bytes.begin(), bytes.end()}, chance);
  } else {
    refusal = inner_.publish(channel, bytes);
  }

  release_due();
  return refusal;
}

std::optional<wire::Refusal> FaultyBus::send_damaged(std::string_view channel,
                                                     std::vector<std::uint8_t> bytes,
                                                     double chance) {
  // The faults share 0..1: each takes its slice.
  const auto falls_to = [&chance](double probability) {
    const bool hit = chance >= 0.0 && chance < probability;
    chance -= probability;
    return hit;
  };

  if (falls_to(plan_.drop)) {
    ++counts_.dropped;
    return std::nullopt;
  }

  if (falls_to(plan_.duplicate)) {
    ++counts_.duplicated;
    inner_.publish(channel, bytes);
    return inner_.publish(channel, bytes);
  }

  if (falls_to(plan_.delay)) {
    ++counts_.delayed;
    held_.push_back({std::string(channel), std::move(bytes), plan_.delay_messages + 1});
    return std::nullopt;
  }

  if (falls_to(plan_.reorder)) {
    ++counts_.reordered;
    held_.push_back({std::string(channel), std::move(bytes), 2});
    return std::nullopt;
  }

  if (falls_to(plan_.corrupt) && !bytes.empty()) {
    ++counts_.corrupted;
    for (std::uint64_t i = 0; i <= random_() % 8; ++i) {
      bytes[random_() % bytes.size()] ^= static_cast<std::uint8_t>(1 + random_() % 255);
    }
    return inner_.publish(channel, bytes);
  }

  if (falls_to(plan_.truncate) && !bytes.empty()) {
    ++counts_.truncated;
    bytes.resize(random_() % bytes.size());
    return inner_.publish(channel, bytes);
  }

  if (falls_to(plan_.flood)) {
    flood(channel);
    return inner_.publish(channel, bytes);
  }

  ++counts_.passed;
  return inner_.publish(channel, bytes);
}

void FaultyBus::flood(std::string_view channel) {
  for (std::size_t i = 0; i < plan_.flood_messages; ++i) {
    std::vector<std::uint8_t> noise(1 + random_() % 256);
    for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random_());
    inner_.publish(channel, noise);
    ++counts_.flood_packets;
  }
}

void FaultyBus::release_due() {
  for (Held& held : held_) --held.release_after;
  const auto is_due = [](const Held& held) { return held.release_after == 0; };
  for (const Held& held : held_) {
    if (is_due(held)) inner_.publish(held.channel, held.bytes);
  }
  std::erase_if(held_, is_due);
}

void FaultyBus::flush() {
  for (const Held& held : held_) inner_.publish(held.channel, held.bytes);
  held_.clear();
}

void FaultyBus::subscribe(std::string_view channel, std::size_t queue_size, Handler handler) {
  inner_.subscribe(channel, queue_size, std::move(handler));
}

bool FaultyBus::handle_one(int timeout_ms) { return inner_.handle_one(timeout_ms); }

std::uint64_t FaultyBus::dropped(std::string_view channel) const { return inner_.dropped(channel); }

}  // namespace understory::test
