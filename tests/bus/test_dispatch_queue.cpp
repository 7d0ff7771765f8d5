// What waits for the handlers, and what is dropped.
#include <vector>

#include "common/bus/datagram_fault.hpp"
#include "common/bus/dispatch_queue.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::bus;

namespace {

std::vector<std::uint8_t> message(std::size_t size, std::uint8_t value) {
  return std::vector<std::uint8_t>(size, value);
}

/// First byte of each message that waits, in order.
std::vector<int> waiting(DispatchQueue& queue) {
  std::vector<int> values;
  while (const auto delivery = queue.take_one()) values.push_back(delivery->bytes.front());
  return values;
}

}  // namespace

TEST_CASE("a queue holds its bytes besides the latest message", "[bus]") {
  DispatchQueue queue(100);
  queue.subscribe("A", 0, {});
  for (std::uint8_t i = 1; i <= 4; ++i) queue.push("A", message(40, i), 0);
  CHECK(queue.dropped("A") == 2);
  CHECK(waiting(queue) == std::vector<int>{3, 4});

  // One that is too large alone is held, and nothing beside it.
  queue.push("A", message(40, 5), 0);
  queue.push("A", message(500, 6), 0);
  CHECK(queue.dropped("A") == 3);
  CHECK(waiting(queue) == std::vector<int>{6});
  queue.push("A", message(50, 7), 0);
  queue.push("A", message(50, 8), 0);
  CHECK(queue.dropped("A") == 3);
  CHECK(waiting(queue) == std::vector<int>{7, 8});
}

TEST_CASE("a queue holds so many messages, the latest ones", "[bus]") {
  DispatchQueue queue;
  queue.subscribe("A", 2, {});
  queue.subscribe_all(3, {});
  for (std::uint8_t i = 1; i <= 4; ++i) queue.push(i == 2 ? "B" : "A", message(10, i), 0);
  CHECK(queue.dropped("A") == 1);
  CHECK(queue.dropped_of_all() == 1);
  CHECK(waiting(queue) == std::vector<int>{2, 3, 3, 4, 4});
}

TEST_CASE("faults of two receivers add up", "[bus]") {
  DatagramFaults faults;
  faults.set(DatagramFault::kRepeated, 3);
  faults.add(DatagramFault::kTooShort);
  DatagramFaults others;
  others.set(DatagramFault::kRepeated, 2);
  others.add(DatagramFault::kIncomplete);
  faults.add(others);
  CHECK(faults.count_of(DatagramFault::kRepeated) == 5);
  CHECK(faults.count_of(DatagramFault::kTooShort) == 1);
  CHECK(faults.count_of(DatagramFault::kIncomplete) == 1);
  CHECK(faults.total() == 7);
}
