// Captures of every kind give the UDP packets that went into them.
#include <random>

#include "common/io/data_error.hpp"
#include "common/io/ip_fragments.hpp"
#include "common/io/packet_capture.hpp"
#include "tests/catch.hpp"
#include "tests/io/capture_file.hpp"

using namespace understory;
using namespace understory::io;
using namespace understory::test;

namespace {

struct Sent {
  std::int64_t utime = 0;
  std::uint32_t from = 0;
  std::uint16_t port = 0;
  test::Bytes payload;
};

/// From nothing to the largest that UDP carries.
std::vector<Sent> random_packets(std::mt19937_64& random) {
  std::vector<Sent> packets;
  const std::size_t sizes[] = {0, 1, 18, 48, 1206, 1472, 1473, 12'608, 24'896, 65'507};
  for (std::size_t i = 0; i < 60; ++i) {
    Sent packet;
    packet.utime = 1'790'000'000'123'456 + static_cast<std::int64_t>(i) * 781;
    packet.from = 0xC0A80100U + static_cast<std::uint32_t>(random() % 3);
    packet.port = static_cast<std::uint16_t>(1 + random() % 65'535);
    packet.payload.resize(i < 10 ? sizes[i] : random() % 9000);
    for (auto& byte : packet.payload) byte = static_cast<std::uint8_t>(random());
    packets.push_back(std::move(packet));
  }
  return packets;
}

}  // namespace

TEST_CASE("UDP packets come back from captures of every kind", "[pcap]") {
  std::mt19937_64 random(1);
  const TemporaryDirectory directory;
  for (const CaptureStyle& style : capture_styles()) {
    CAPTURE(static_cast<int>(style.file), static_cast<int>(style.link), style.mtu);
    const auto packets = random_packets(random);
    CaptureFile file(style);
    for (const Sent& packet : packets) {
      if (random() % 4 == 0) file.add_noise(packet.utime);
      file.add(packet.utime, packet.from, packet.port, packet.payload);
    }
    write_bytes(directory / "a.pcap", file.bytes());

    PacketCapture capture(directory / "a.pcap");
    for (const Sent& packet : packets) {
      const auto read = capture.next();
      REQUIRE(read);
      CHECK(read->utime == packet.utime);
      CHECK(read->sender == packet.from);
      CHECK(read->source_port == 50'000);
      CHECK(read->port == packet.port);
      REQUIRE(read->payload == packet.payload);
    }
    CHECK_FALSE(capture.next());
    CHECK_FALSE(capture.is_cut_off());
    CHECK(capture.counts().fragments > 100);
    CHECK(capture.counts().incomplete == 0);
  }
}

TEST_CASE("a packet that lacks a fragment is left out and counted", "[pcap]") {
  std::mt19937_64 random(2);
  const TemporaryDirectory directory;
  CaptureFile file;
  std::size_t lost = 0;
  const auto packets = random_packets(random);
  std::vector<Sent> whole;
  for (const Sent& packet : packets) {
    const std::size_t fragments = (packet.payload.size() + 8 + 1479) / 1480;
    const bool loses = fragments > 1 && random() % 2 == 0;
    const int which = loses ? static_cast<int>(random() % fragments) : -1;
    file.add(packet.utime, packet.from, packet.port, packet.payload, which);
    loses ? static_cast<void>(++lost) : whole.push_back(packet);
  }
  write_bytes(directory / "a.pcap", file.bytes());
  REQUIRE(lost > 10);

  PacketCapture capture(directory / "a.pcap");
  for (const Sent& packet : whole) {
    const auto read = capture.next();
    REQUIRE(read);
    REQUIRE(read->payload == packet.payload);
  }
  CHECK_FALSE(capture.next());
  CHECK(capture.counts().incomplete == lost);
}

TEST_CASE("fragments are joined within bounds", "[pcap]") {
  const test::Bytes bytes(1000, 7);
  IpReassembler fragments;
  const auto fragment = [&](std::uint16_t id, std::size_t offset, bool is_last) {
    return IpFragment{1, 2, id, offset, is_last, bytes};
  };

  // An identification that comes again later is another datagram's.
  CHECK_FALSE(fragments.add(fragment(5, 0, false), 0));
  CHECK_FALSE(fragments.add(fragment(5, 1000, true), 60'000'000));
  CHECK(fragments.dropped() == 1);
  CHECK(fragments.add(fragment(5, 0, false), 60'000'100).value().size() == 2000);

  // One that overlaps never becomes a datagram.
  CHECK_FALSE(fragments.add(fragment(6, 0, false), 60'000'200));
  CHECK_FALSE(fragments.add(fragment(6, 504, true), 60'000'200));
  CHECK_FALSE(fragments.add(fragment(7, 65'528, true), 60'000'200));

  for (std::uint16_t id = 100; id < 1000; ++id) {
    CHECK_FALSE(fragments.add(fragment(id, 0, false), 60'000'300));
    CHECK(fragments.pending() <= 64);
  }
  CHECK(fragments.dropped() + fragments.pending() == 1 + 1 + 900);
}

TEST_CASE("damaged captures end or give packets, whatever their kind", "[pcap]") {
  std::mt19937_64 random(3);
  const TemporaryDirectory directory;
  for (const CaptureStyle& style : capture_styles()) {
    CaptureFile file(style);
    for (const Sent& packet : random_packets(random))
      file.add(packet.utime, packet.from, packet.port, packet.payload);
    for (int trial = 0; trial < 20; ++trial) {
      test::Bytes damaged = file.bytes();
      if (trial % 2 == 0) damaged.resize(random() % damaged.size());
      for (int k = 0; k < 20 && !damaged.empty(); ++k)
        damaged[random() % damaged.size()] = static_cast<std::uint8_t>(random());
      write_bytes(directory / "a.pcap", damaged);
      try {
        PacketCapture capture(directory / "a.pcap");
        while (const auto packet = capture.next()) REQUIRE(packet->payload.size() <= 65'535);
      } catch (const DataError& error) {
        CHECK(std::string(error.what()).find("a.pcap") != std::string::npos);
      }
    }
  }
}
