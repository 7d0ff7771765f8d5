// A hundred thousand damaged and hostile messages: none may crash, hang, or take more memory than
// four times its size.
#include <atomic>
#include <cstdlib>
#include <new>

#include "tests/catch.hpp"
#include "tests/wire/all_types.hpp"
#include "tests/wire/random_message.hpp"

namespace {

// Bytes asked for since the latest reset; nothing is subtracted, so it bounds the peak from above.
std::atomic<std::size_t> allocated_bytes{0};

}  // namespace

void* operator new(std::size_t size, const std::nothrow_t& /*tag*/) noexcept {
  allocated_bytes += size;
  return std::malloc(size);
}
void* operator new(std::size_t size) {
  if (void* memory = operator new(size, std::nothrow)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace {

using namespace understory;
using namespace understory::wire;
using namespace understory::test;

/// One kind of damage to a message.
void damage(Bytes& bytes, const std::vector<std::size_t>& lengths, std::mt19937_64& random) {
  const std::uint32_t extremes[] = {0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x00FFFFFF, 4096};
  switch (random() % 7) {
    case 0:  // bits
      for (std::uint64_t i = 0; i <= random() % 8; ++i) {
        bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1U << (random() % 8));
      }

      break;
    case 1:  // bytes behind the fingerprint
      for (std::uint64_t i = 0; i <= random() % 16; ++i) {
        bytes[8 + random() % (bytes.size() - 8)] = static_cast<std::uint8_t>(random());
      }

      break;
    case 2:  // cut
      bytes.resize(random() % bytes.size());
      break;
    case 3:  // longer
      bytes.resize(bytes.size() + 1 + random() % 64, static_cast<std::uint8_t>(random()));
      break;

    case 4:  // a hostile count or length
      if (!lengths.empty())
        put(bytes, lengths[random() % lengths.size()], extremes[random() % 7], 4);
      break;
    case 5:  // noise behind a right fingerprint
      for (std::size_t i = 8; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(random());
      break;
    default:  // a count that fits what is left in bytes, not in elements

      if (!lengths.empty()) {
        put(bytes, lengths[random() % lengths.size()], random() % bytes.size(), 4);
      }
  }
}

struct Tally {
  std::size_t packets = 0;
  std::size_t accepted = 0;
  std::size_t refused = 0;
  std::size_t beyond_memory = 0;
};

template <class T>
void fuzz(std::size_t packets, std::mt19937_64& random, Tally& tally) {
  constexpr std::size_t kFixed = 2048;  // the message itself, the refusal's text
  const WireType& type = wire_type_of<typename WireOf<T>::type>();
  for (std::size_t i = 0; i < packets; ++i) {
    std::vector<std::size_t> lengths;
    Bytes bytes = random_message(type, random, nullptr, &lengths);
    damage(bytes, lengths, random);
    allocated_bytes = 0;
    const auto message = decode_message<T>(bytes);

    if (allocated_bytes > 4 * bytes.size() + kFixed) {
      ++tally.beyond_memory;
      WARN("beyond memory: " << type.layout->name << ": " << allocated_bytes << " for "
                             << bytes.size());
    }

    ++tally.packets;
    ++(message ? tally.accepted : tally.refused);
    if (!message && message.refusal().detail.empty()) FAIL("a refusal without a text");
  }
}

}  // namespace

TEST_CASE("a hundred thousand damaged packets over all types") {
  constexpr std::size_t kEach = 3000;
  std::mt19937_64 random(20260101);
  Tally tally;
  test::for_each_type<test::AllTypes>([&]<class T>(T*) { fuzz<T>(kEach, random, tally); });
  test::for_each_type<test::AllValues>([&]<class T>(T*) { fuzz<T>(kEach, random, tally); });
  CHECK(tally.packets >= 100000);
  CHECK(tally.accepted + tally.refused == tally.packets);
  CHECK(tally.refused > tally.packets / 2);
  CHECK(tally.accepted > 0);
  CHECK(tally.beyond_memory == 0);
}

TEST_CASE("a large message of every kind decodes in four times its size") {
  landmarks_t scan{};
  scan.max_range_m = 40.0;
  scan.width_rad = 6.0;
  scan.num_detections = 10000;
  scan.detections.assign(10000, detection_t{});
  const Bytes bytes = encode_bytes(scan);
  allocated_bytes = 0;
  REQUIRE(decode_message<model::LandmarkScan>(bytes));
  CHECK(allocated_bytes >= bytes.size());  // it does count
  CHECK(allocated_bytes <= 4 * bytes.size());

  map_delta_t delta{};
  delta.version = 1;
  delta.num_removed = 10000;
  delta.removed.assign(10000, 1);
  const Bytes removal = encode_bytes(delta);
  allocated_bytes = 0;
  REQUIRE(decode_message<model::MapDelta>(removal));
  CHECK(allocated_bytes <= 4 * removal.size());
}
