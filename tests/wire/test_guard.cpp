// The walk over bytes: agrees with lcm-gen's own coders, and refuses what would harm them.
#include <limits>
#include <set>

#include "tests/catch.hpp"
#include "tests/wire/all_types.hpp"
#include "tests/wire/random_message.hpp"

using namespace understory;
using namespace understory::wire;
using namespace understory::test;

TEST_CASE("the table has every type, with the fingerprint that lcm-gen gives it") {
  std::size_t types = 0;
  std::set<std::int64_t> fingerprints;
  test::for_each_type<test::AllTypes>([&]<class T>(T*) {
    const WireType* type = find_wire_type(T::getTypeName());
    REQUIRE(type != nullptr);
    CHECK(type->fingerprint() == T::getHash());
    CHECK(find_wire_type(T::getHash()) == type);
    fingerprints.insert(T::getHash());
    ++types;
  });

  CHECK(types == wire_types().size());
  CHECK(fingerprints.size() == types);
  CHECK(find_wire_type("no_such_t") == nullptr);
}

TEST_CASE("what the layout calls well-formed decodes, and encodes to the same bytes") {
  std::mt19937_64 random(1);
  test::for_each_type<test::AllTypes>([&]<class T>(T*) {
    for (int i = 0; i < 50; ++i) {
      const Bytes bytes = random_message(wire_type_of<T>(), random);
      const auto message = decode_bytes<T>(bytes);
      INFO(T::getTypeName() << ": " << (message ? "" : message.refusal().detail));
      REQUIRE(message);
      CHECK(encode_bytes(*message) == bytes);
    }
  });
}

TEST_CASE("a message cut anywhere, or with anything behind it, is refused") {
  std::mt19937_64 random(2);
  for (const WireType& type : wire_types()) {
    const Bytes bytes = random_message(type, random);
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      INFO(type.layout->name << " cut to " << size << " of " << bytes.size());
      const auto refusal = check_bytes(std::span(bytes).first(size), type);
      REQUIRE(refusal);
      const bool says_why = refusal->reason == Reason::kTooShort ||
                            refusal->reason == Reason::kBadCount ||
                            refusal->reason == Reason::kBadString;
      CHECK(says_why);
    }

    Bytes longer = bytes;
    longer.push_back(0);
    const auto refusal = check_bytes(longer, type);
    REQUIRE(refusal);
    CHECK(refusal->reason == Reason::kTooLong);
  }
}

TEST_CASE("a number that is not finite is refused in every field that could hold one") {
  std::mt19937_64 random(3);
  std::size_t places = 0;
  for (const WireType& type : wire_types()) {
    std::vector<test::RealPlace> reals;
    const Bytes bytes = random_message(type, random, &reals);
    for (const test::RealPlace& real : reals) {
      const bool is_double = real.kind == FieldKind::kDouble;
      for (const std::uint64_t value :
           {is_double ? 0x7FF8000000000000ULL : 0x7FC00000ULL,     // NaN
            is_double ? 0x7FF0000000000000ULL : 0x7F800000ULL,     // infinity
            is_double ? 0xFFF0000000000000ULL : 0xFF800000ULL}) {  // minus infinity
        Bytes bad = bytes;
        put(bad, real.offset, value, is_double ? 8 : 4);
        const auto refusal = check_bytes(bad, type);
        REQUIRE(refusal);
        CHECK(refusal->reason == Reason::kNotFinite);
        ++places;
      }
    }
  }

  CHECK(places > 300);
}

TEST_CASE("hostile counts and string lengths are refused wherever they are") {
  std::mt19937_64 random(4);
  std::size_t places = 0;
  for (const WireType& type : wire_types()) {
    std::vector<std::size_t> lengths;
    const Bytes bytes = random_message(type, random, nullptr, &lengths);
    for (const std::size_t offset : lengths) {
      for (const std::int32_t value : {-1, std::numeric_limits<std::int32_t>::min(),
                                       std::numeric_limits<std::int32_t>::max(), 1 << 24}) {
        Bytes bad = bytes;
        put(bad, offset, static_cast<std::uint32_t>(value), 4);
        const auto refusal = check_bytes(bad, type);
        REQUIRE(refusal);
        const bool says_why =
            refusal->reason == Reason::kBadCount || refusal->reason == Reason::kBadString;
        CHECK(says_why);
        ++places;
      }
    }
  }

  CHECK(places > 60);
}

TEST_CASE("a boolean is 0 or 1 wherever it is") {
  std::mt19937_64 random(6);
  std::set<std::string_view> types;
  for (const WireType& type : wire_types()) {
    std::vector<std::size_t> booleans;
    const Bytes bytes = random_message(type, random, nullptr, nullptr, &booleans);
    for (const std::size_t offset : booleans) {
      types.insert(type.layout->name);
      for (unsigned value = 0; value < 256; ++value) {
        Bytes changed = bytes;
        put(changed, offset, value, 1);
        const auto refusal = check_bytes(changed, type);
        REQUIRE(refusal.has_value() == (value > 1));
        if (refusal) CHECK(refusal->reason == Reason::kOutOfRange);
      }
    }
  }
  CHECK(types.size() >= 3);
}

TEST_CASE("a list adds its elements' bytes to a message") {
  for (const std::size_t count : {0, 1, 7, 1000}) {
    landmarks_t scan{};
    scan.num_detections = static_cast<std::int32_t>(count);
    scan.detections.resize(count);
    CHECK(bytes_with<landmarks_t, detection_t>(count) == encode_bytes(scan).size());
    map_t map{};
    map.num_landmarks = static_cast<std::int32_t>(count);
    map.landmarks.resize(count);
    CHECK(bytes_with<map_t, map_landmark_t>(count) == encode_bytes(map).size());
  }
}

TEST_CASE("a string of length zero, without end or with a zero inside is refused") {
  log_t message{};
  message.text = "abc";
  const Bytes good = encode_bytes(message);
  REQUIRE_FALSE(check_bytes(good, wire_type_of<log_t>()));

  for (const auto& [offset_from_end, value] : {std::pair<std::size_t, int>{1, 'x'}, {2, 0}}) {
    Bytes bad = good;
    bad[bad.size() - offset_from_end] = static_cast<std::uint8_t>(value);
    const auto refusal = check_bytes(bad, wire_type_of<log_t>());
    REQUIRE(refusal);
    CHECK(refusal->reason == Reason::kBadString);
    CHECK(refusal->detail.rfind("text: ", 0) == 0);
  }

  Bytes empty = good;
  put(empty, good.size() - 8, 0, 4);
  REQUIRE(check_bytes(empty, wire_type_of<log_t>()));
}

TEST_CASE("another type's message and stamps out of range are named") {
  const auto other = check_bytes(encode_bytes(wheels_t{}), wire_type_of<landmarks_t>());
  REQUIRE(other);
  CHECK(other->reason == Reason::kWrongType);
  CHECK(other->detail == "expected landmarks_t, got wheels_t");
  wheels_t past{};
  past.utime = -1;
  CHECK(check_bytes(encode_bytes(past), wire_type_of<wheels_t>())->detail == "utime: -1");
  wheels_t uncounted{};
  uncounted.seq = -5;
  CHECK(check_bytes(encode_bytes(uncounted), wire_type_of<wheels_t>())->detail == "seq: -5");
}

TEST_CASE("a refusal names the place") {
  landmarks_t scan{};
  scan.num_detections = 2;
  scan.detections.resize(2);
  scan.detections[0] = detection_t{};
  scan.detections[1] = detection_t{};
  scan.detections[1].covariance_m2[1][2] = std::numeric_limits<double>::quiet_NaN();
  const auto refusal = check_bytes(encode_bytes(scan), wire_type_of<landmarks_t>());
  REQUIRE(refusal);
  CHECK(refusal->detail == "detections[1].covariance_m2[5]: is not finite");
}
