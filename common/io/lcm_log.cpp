#include "common/io/lcm_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "common/io/file_window.hpp"
#include "common/io/lcm_log_format.hpp"

namespace understory::io {
namespace {

/// Offset of the magic number in these bytes. The search has the speed of reading memory.
std::optional<std::size_t> magic_in(std::span<const std::uint8_t> bytes) {
  const std::uint8_t* at = bytes.data();
  const std::uint8_t* const end = at + bytes.size();
  while (at != end) {
    const auto left = static_cast<std::size_t>(end - at);
    at = static_cast<const std::uint8_t*>(std::memchr(at, kMagicBytes[0], left));
    if (at == nullptr || static_cast<std::size_t>(end - at) < kMagicBytes.size()) break;
    if (std::equal(kMagicBytes.begin(), kMagicBytes.end(), at))
      return static_cast<std::size_t>(at - bytes.data());
    ++at;
  }
  return std::nullopt;
}

}  // namespace

class LcmLogReader::Impl {
 public:
  explicit Impl(const std::filesystem::path& path) : path_(path), file_(path) {}

  std::optional<LogEvent> next() {
    while (position_ < file_.size()) {
      const auto header = header_at(position_);
      if (header && trustworthy(*header)) return take(*header);
      skip_to(confirmed_from(position_ + 1));
    }
    close_place();
    return std::nullopt;
  }

  void refuse_other_files() {
    if (has_event_ || file_.size() == 0 || position_ < file_.size()) return;
    if (begins_like_event(0)) return;
    throw LogError(
        fmt::format("{}: no LCM log: no event in {} bytes", path_.string(), file_.size()));
  }

  const LogDamage& damage() const { return damage_; }
  std::uint64_t position() const { return position_; }
  std::uint64_t size() const { return file_.size(); }

 private:
  /// The header of an event that fits into the file and has a valid channel name.
  std::optional<Header> header_at(std::uint64_t offset) {
    const auto bytes = file_.peek(offset, kHeaderBytes + kMaxChannelBytes);
    if (bytes.size() < kHeaderBytes) return std::nullopt;
    const auto header = decode(bytes.first<kHeaderBytes>());
    if (!header || header->event_bytes() > file_.size() - offset) return std::nullopt;
    if (bytes.size() < kHeaderBytes + header->channel_bytes) return std::nullopt;
    if (!plausible_channel(bytes.subspan(kHeaderBytes, header->channel_bytes))) {
      return std::nullopt;
    }
    return header;
  }

  /// Whether the magic number is here, or its first bytes at the end of a cut file.
  bool begins_like_event(std::uint64_t offset) {
    std::array<std::uint8_t, 4> bytes{};
    const auto left = static_cast<std::size_t>(std::min<std::uint64_t>(4, file_.size() - offset));
    return file_.read(offset, std::span(bytes).first(left)) &&
           std::equal(bytes.begin(), bytes.begin() + left, kMagicBytes.begin());
  }

  /// Whether another event starts where this one ends.
  bool followed_by_event(std::uint64_t offset, const Header& header) {
    return begins_like_event(offset + header.event_bytes());
  }

  /// If no event follows, either this header's lengths or the next header is damaged. It is the
  /// next header if remains of a header are there: the number after this one's, or lengths that
  /// lead to a certain next event.
  bool trustworthy(const Header& header) {
    const std::uint64_t end = position_ + header.event_bytes();
    if (followed_by_event(position_, header)) return true;
    const std::uint64_t resumes = confirmed_from(position_ + 1);
    std::array<std::uint8_t, kHeaderBytes> bytes{};
    if (resumes < end || !file_.read(end, bytes)) return false;
    const Header next = decode_fields(bytes);
    return (header.number < INT64_MAX && next.number == header.number + 1) ||
           end + next.event_bytes() == resumes;
  }

  /// Offset of the first event at or after `offset` that is followed by another event or by the end
  /// of the file; the size of the file if there is none. The result is stored, so that the whole
  /// file is searched at most once.
  std::uint64_t confirmed_from(std::uint64_t offset) {
    if (offset <= confirmed_) return confirmed_;
    std::uint64_t at = offset;
    while ((at = find_magic(at)) < file_.size()) {
      const auto header = header_at(at);
      if (header && followed_by_event(at, *header)) break;
      ++at;
    }
    return confirmed_ = std::min(at, file_.size());
  }

  /// Offset of the next magic number at or after `offset`; the size of the file if there is none.
  /// Holes of the file are skipped: they read as zeros, and the number has none.
  std::uint64_t find_magic(std::uint64_t offset) {
    constexpr std::size_t kStep = 65536;
    while ((offset = file_.data_from(offset)) < file_.size()) {
      const auto bytes = file_.peek(offset, kStep);
      if (const auto at = magic_in(bytes)) return offset + *at;
      if (bytes.size() < kStep) return file_.size();
      offset += kStep - (kMagicBytes.size() - 1);
    }
    return file_.size();
  }

  void skip_to(std::uint64_t offset) {
    if (!in_place_) {
      in_place_ = true;
      ++damage_.places;
      damage_.last_offset = position_;
      damage_.last_bytes = 0;
    }
    damage_.bytes += offset - position_;
    damage_.last_bytes += offset - position_;
    position_ = offset;
  }

  void close_place() { in_place_ = false; }

  std::optional<LogEvent> take(const Header& header) {
    LogEvent event;
    event.number = header.number;
    event.utime = header.utime;
    event.channel.resize(header.channel_bytes);
    event.data.resize(header.data_bytes);
    const auto channel = file_.peek(position_ + kHeaderBytes, header.channel_bytes);
    std::copy(channel.begin(), channel.end(), event.channel.begin());

    if (!file_.read(position_ + kHeaderBytes + header.channel_bytes, event.data)) {
      skip_to(file_.size());  // The file has shrunk since it was opened.
      return std::nullopt;
    }

    // Only a gap across damage is a loss: a cut or filtered log has intended gaps. No damage hides
    // more than two billion events.
    if (in_place_ && event.number > next_number_ && event.number - next_number_ < (1LL << 31)) {
      damage_.events_lost += static_cast<std::uint64_t>(event.number - next_number_);
    }

    close_place();
    has_event_ = true;
    next_number_ = event.number < INT64_MAX ? event.number + 1 : event.number;
    position_ += header.event_bytes();

    return event;
  }

  std::filesystem::path path_;
  FileWindow file_;
  bool has_event_ = false;
  std::uint64_t position_ = 0;
  std::uint64_t confirmed_ = 0;
  std::int64_t next_number_ = 0;
  bool in_place_ = false;
  LogDamage damage_;
};

LcmLogReader::LcmLogReader(const std::filesystem::path& path)
    : impl_(std::make_unique<Impl>(path)) {}
LcmLogReader::~LcmLogReader() = default;
LcmLogReader::LcmLogReader(LcmLogReader&&) noexcept = default;
LcmLogReader& LcmLogReader::operator=(LcmLogReader&&) noexcept = default;

std::optional<LogEvent> LcmLogReader::next() { return impl_->next(); }
void LcmLogReader::refuse_other_files() const { impl_->refuse_other_files(); }
const LogDamage& LcmLogReader::damage() const { return impl_->damage(); }
std::uint64_t LcmLogReader::position_bytes() const { return impl_->position(); }
std::uint64_t LcmLogReader::size_bytes() const { return impl_->size(); }

}  // namespace understory::io
