#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <limits>
#include <utility>

#include "common/io/data_error.hpp"
#include "common/io/lcm_log.hpp"
#include "common/io/lcm_log_format.hpp"
#include "common/io/output_file.hpp"

namespace understory::io {

class LcmLogWriter::Impl {
 public:
  Impl(const std::filesystem::path& path, LogCreation creation)
      : path_(target_of(path)), grows_(creation != LogCreation::kWhole) {
    struct stat status {};
    // A device must not be replaced by a file: /dev/full must stay a device.
    direct_ = ::stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode);
    if (direct_) {
      descriptor_ = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    } else if (grows_) {
      const int existing = creation == LogCreation::kGrowing ? O_EXCL : O_TRUNC;
      descriptor_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | existing, 0666);
    } else {
      open_temporary();
    }
    if (descriptor_ < 0) fail("cannot write");
    buffer_.reserve(kBufferBytes);
  }

  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  ~Impl() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (!temporary_.empty()) ::unlink(temporary_.c_str());
  }

  void write(std::int64_t number, std::int64_t utime, std::string_view channel,
             std::span<const std::uint8_t> data) {
    if (descriptor_ < 0) throw LogError(fmt::format("{}: already closed", path_.string()));
    if (channel.empty() || channel.size() > kMaxChannelBytes) {
      throw LogError(fmt::format("{}: channel \"{}\": a channel has 1 to {} bytes", path_.string(),
                                 channel, kMaxChannelBytes));
    }

    if (data.size() > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max())) {
      throw LogError(fmt::format("{}: channel \"{}\": {} bytes are more than an event holds",
                                 path_.string(), channel, data.size()));
    }

    const auto header = encode({number, utime, static_cast<std::uint32_t>(channel.size()),
                                static_cast<std::uint32_t>(data.size())});
    buffer_.insert(buffer_.end(), header.begin(), header.end());
    buffer_.insert(buffer_.end(), channel.begin(), channel.end());
    buffer_.insert(buffer_.end(), data.begin(), data.end());
    ++events_;
    if (buffer_.size() >= kBufferBytes) flush();
  }

  void commit() {
    if (descriptor_ < 0) return;
    flush();
    if (!direct_ && ::fsync(descriptor_) != 0) fail("cannot write");
    const int descriptor = std::exchange(descriptor_, -1);
    if (::close(descriptor) != 0) fail("cannot write");
    if (direct_ || grows_) return;
    if (::rename(temporary_.c_str(), path_.c_str()) != 0) fail("cannot give the file its name");
    temporary_.clear();
  }

  std::uint64_t events() const { return events_; }

  void flush() {
    std::size_t done = 0;
    while (done < buffer_.size()) {
      const ssize_t put = ::write(descriptor_, buffer_.data() + done, buffer_.size() - done);
      if (put < 0 && errno == EINTR) continue;
      if (put < 0) fail("cannot write");
      done += static_cast<std::size_t>(put);
    }
    buffer_.clear();
  }

 private:
  /// A link stays a link: its target is written.
  static std::filesystem::path target_of(const std::filesystem::path& path) {
    try {
      return behind_links(path);
    } catch (const DataError& error) {
      throw LogError(error.what());
    }
  }

  void open_temporary() {
    temporary_ = path_.string() + ".part-XXXXXX";
    descriptor_ = ::mkostemp(temporary_.data(), O_CLOEXEC);
    if (descriptor_ < 0) {
      temporary_.clear();
      return;
    }
    // mkostemp creates a private file; the user's mask must apply, as for any other file.
    const mode_t mask = ::umask(0);
    ::umask(mask);
    ::fchmod(descriptor_, 0666U & ~mask);
  }

  [[noreturn]] void fail(std::string_view what) {
    throw LogError(fmt::format("{}: {}: {}", path_.string(), what, std::strerror(errno)));
  }

  static constexpr std::size_t kBufferBytes = 256 * 1024;

  std::filesystem::path path_;
  std::string temporary_;
  bool direct_ = false;
  bool grows_ = false;
  int descriptor_ = -1;
  std::uint64_t events_ = 0;
  std::vector<std::uint8_t> buffer_;
};

namespace {

/// Protects a file given to --out by mistake (a map, a table, a recording).
const std::filesystem::path& not_another_file(const std::filesystem::path& path) {
  std::error_code failed;
  const bool is_file = std::filesystem::is_regular_file(path, failed);
  if (is_file && std::filesystem::file_size(path, failed) > 0 && !begins_as_log(path))
    throw LogError(path.string() + ": is there already and is no LCM log: it is not overwritten");
  return path;
}

}  // namespace

LcmLogWriter::LcmLogWriter(const std::filesystem::path& path, LogCreation creation)
    : impl_(std::make_unique<Impl>(not_another_file(path), creation)) {}
LcmLogWriter::~LcmLogWriter() = default;
LcmLogWriter::LcmLogWriter(LcmLogWriter&&) noexcept = default;
LcmLogWriter& LcmLogWriter::operator=(LcmLogWriter&&) noexcept = default;

void LcmLogWriter::write(const LogEvent& event) {
  impl_->write(event.number, event.utime, event.channel, event.data);
}
void LcmLogWriter::write(std::int64_t utime, std::string_view channel,
                         std::span<const std::uint8_t> data) {
  impl_->write(static_cast<std::int64_t>(impl_->events()), utime, channel, data);
}
void LcmLogWriter::flush() { impl_->flush(); }
void LcmLogWriter::commit() { impl_->commit(); }
std::uint64_t LcmLogWriter::events() const { return impl_->events(); }

}  // namespace understory::io
