#include "common/bus/udpm_reassembly.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace understory::bus {
namespace {

/// Interval of the search for stale messages [us].
constexpr std::int64_t kSweepPeriodUs = 100000;

}  // namespace

std::size_t UdpmReassembler::held_messages() const {
  return std::accumulate(
      senders_.begin(), senders_.end(), std::size_t{0},
      [](std::size_t sum, const auto& one) { return sum + one.second.messages.size(); });
}

UdpmReassembler::Taken UdpmReassembler::refuse(DatagramFault fault) {
  faults_.add(fault);
  return {std::nullopt, fault};
}

UdpmReassembler::Taken UdpmReassembler::take(std::span<const std::uint8_t> datagram,
                                             DatagramSender sender, std::int64_t now_us) {
  if (!payload_.empty()) payload_ = {};  // a large message is freed as documented
  drop_stale(now_us);
  const auto decoded = decode_datagram(datagram);
  if (const auto* fault = std::get_if<DatagramFault>(&decoded)) return refuse(*fault);
  if (const auto* message = std::get_if<ShortMessage>(&decoded)) {
    return {Message{message->channel, message->payload}, std::nullopt};
  }

  const auto& fragment = std::get<Fragment>(decoded);
  if (fragment.count > 1) return take_fragment(fragment, sender, now_us);
  if (fragment.payload.size() != fragment.message_size) {
    return refuse(DatagramFault::kContradictory);
  }
  return {Message{fragment.channel, fragment.payload}, std::nullopt};
}

UdpmReassembler::Taken UdpmReassembler::take_fragment(const Fragment& fragment, DatagramSender from,
                                                      std::int64_t now_us) {
  // Is it consistent with earlier fragments, and is its channel subscribed?
  const auto known = senders_.find(from);
  if (known != senders_.end()) {
    if (const auto taken = take_of_known(fragment, known->second)) return *taken;
  }
  if (is_unwanted(fragment)) {
    throw_away(fragment, from, now_us);
    return {};
  }

  // Reserve a place in the tables, then memory.
  if (!make_place(fragment, from)) return refuse(DatagramFault::kNoRoom);
  const auto sender = senders_.try_emplace(from).first;
  const auto [half, is_new] = sender->second.messages.try_emplace(fragment.sequence, fragment);
  const std::size_t own = is_new ? half->second.held_bytes() : 0;
  sender->second.held_bytes += own;
  held_bytes_ += own;

  const std::size_t bytes = PartialMessage::cost(fragment);
  if (!make_room(bytes, sender, fragment.sequence)) {
    drop(sender->second, half);
    if (sender->second.is_idle()) senders_.erase(sender);
    return refuse(DatagramFault::kNoRoom);
  }

  half->second.add(fragment, now_us);
  sender->second.held_bytes += bytes;
  held_bytes_ += bytes;
  if (!half->second.is_complete()) return {};
  settle(fragment, sender->second, true, now_us);
  return finish(sender->second, half);
}

const UdpmReassembler::Settled* UdpmReassembler::Sender::settled_message(
    const Fragment& fragment) const {
  const auto found = std::find_if(settled.rbegin(), settled.rend(), [&](const Settled& one) {
    return one.sequence == fragment.sequence && one.message_size == fragment.message_size &&
           one.count == fragment.count;
  });
  return found == settled.rend() ? nullptr : &*found;
}

/// The result for a fragment of a known message; none = it may be added.
std::optional<UdpmReassembler::Taken> UdpmReassembler::take_of_known(const Fragment& fragment,
                                                                     const Sender& sender) {
  const auto half = sender.messages.find(fragment.sequence);
  if (half != sender.messages.end()) {
    const auto fault = half->second.check(fragment);
    return fault ? std::optional(refuse(*fault)) : std::nullopt;
  }

  const Settled* settled = sender.settled_message(fragment);
  if (settled == nullptr) return std::nullopt;
  return settled->was_given ? refuse(DatagramFault::kRepeated) : Taken{};
}

bool UdpmReassembler::is_unwanted(const Fragment& fragment) const {
  return fragment.number == 0 && wanted_ && !wanted_(fragment.channel);
}

/// Drops the received fragments of the message and marks its later ones as unwanted.
void UdpmReassembler::throw_away(const Fragment& fragment, DatagramSender from,
                                 std::int64_t now_us) {
  if (!senders_.contains(from) && !make_place(fragment, from)) return;
  Sender& sender = senders_[from];
  const auto half = sender.messages.find(fragment.sequence);
  if (half != sender.messages.end()) drop(sender, half);
  settle(fragment, sender, false, now_us);
}

void UdpmReassembler::settle(const Fragment& fragment, Sender& sender, bool was_given,
                             std::int64_t now_us) {
  sender.settled.push_back(
      {fragment.sequence, fragment.message_size, fragment.count, was_given, now_us});
  if (sender.settled.size() > limits_.settled_of_sender) sender.settled.pop_front();
}

UdpmReassembler::Taken UdpmReassembler::finish(Sender& sender, Messages::iterator message) {
  const bool is_short = message->second.is_short();
  if (!is_short) {
    channel_ = message->second.channel();
    payload_ = message->second.take_payload();
  }
  drop(sender, message);
  if (is_short) return refuse(DatagramFault::kContradictory);
  return {Message{channel_, payload_}, std::nullopt};
}

/// Makes a place in the table of senders and among the sender's messages; false = other senders
/// have priority.
bool UdpmReassembler::make_place(const Fragment& fragment, DatagramSender from) {
  const auto known = senders_.find(from);
  if (known != senders_.end()) {
    Sender& sender = known->second;
    if (sender.messages.contains(fragment.sequence)) return true;
    while (sender.messages.size() >= limits_.messages_of_sender) {
      drop_oldest(sender, nullptr);
      faults_.add(DatagramFault::kNoRoom);
    }
    return true;
  }

  if (senders_.size() < limits_.senders) return true;
  const auto least = std::min_element(
      senders_.begin(), senders_.end(),
      [](const auto& a, const auto& b) { return a.second.held_bytes < b.second.held_bytes; });
  if (least->second.held_bytes >= PartialMessage::cost(fragment)) return false;
  while (drop_oldest(least->second, nullptr)) faults_.add(DatagramFault::kNoRoom);
  senders_.erase(least);
  return true;
}

/// Makes room for `bytes` more of a message; false = only senders that use less could free it.
bool UdpmReassembler::make_room(std::size_t bytes, Senders::iterator sender,
                                std::uint32_t sequence) {
  while (sender->second.held_bytes + bytes > limits_.sender_bytes) {
    if (!drop_oldest(sender->second, &sequence)) return false;
    faults_.add(DatagramFault::kNoRoom);
  }

  while (held_bytes_ + bytes > limits_.total_bytes) {
    auto largest = sender;
    std::size_t most = sender->second.held_bytes + bytes;
    for (auto one = senders_.begin(); one != senders_.end(); ++one) {
      if (one->second.held_bytes <= most) continue;
      largest = one;
      most = one->second.held_bytes;
    }

    const bool is_own = largest == sender;
    if (!drop_oldest(largest->second, is_own ? &sequence : nullptr)) return false;
    faults_.add(DatagramFault::kNoRoom);
    if (largest->second.is_idle()) senders_.erase(largest);
  }
  return true;
}

/// Drops the message with the oldest latest fragment; false = there is none except the spared one.
bool UdpmReassembler::drop_oldest(Sender& sender, const std::uint32_t* spared) {
  auto oldest = sender.messages.end();
  for (auto one = sender.messages.begin(); one != sender.messages.end(); ++one) {
    if (spared != nullptr && one->first == *spared) continue;
    const bool is_older =
        oldest == sender.messages.end() || one->second.touched_us() < oldest->second.touched_us();
    if (is_older) oldest = one;
  }

  if (oldest == sender.messages.end()) return false;
  drop(sender, oldest);
  return true;
}

void UdpmReassembler::drop(Sender& sender, Messages::iterator message) {
  sender.held_bytes -= message->second.held_bytes();
  held_bytes_ -= message->second.held_bytes();
  sender.messages.erase(message);
}

void UdpmReassembler::drop_stale(std::int64_t now_us) {
  if (now_us - swept_us_ < kSweepPeriodUs) return;
  swept_us_ = now_us;

  for (auto sender = senders_.begin(); sender != senders_.end();) {
    Messages& messages = sender->second.messages;
    for (auto one = messages.begin(); one != messages.end();) {
      const auto next = std::next(one);
      if (now_us - one->second.touched_us() > limits_.stale_us) {
        drop(sender->second, one);
        faults_.add(DatagramFault::kIncomplete);
      }
      one = next;
    }

    auto& settled = sender->second.settled;
    while (!settled.empty() && now_us - settled.front().settled_us > limits_.stale_us) {
      settled.pop_front();
    }
    sender = sender->second.is_idle() ? senders_.erase(sender) : std::next(sender);
  }
}

}  // namespace understory::bus
