#include "service/reproduce/xz.hpp"

#include <array>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include <lzma.h>

namespace skylight::service::reproduce {
namespace {

constexpr std::size_t kMostUnpacked = std::size_t{64} << 20;
constexpr std::uint64_t kMostMemory = std::uint64_t{256} << 20;  // xz -9 needs 65 MiB to unpack

const char* reason(lzma_ret result) {
  switch (result) {
    case LZMA_FORMAT_ERROR:
      return "is not packed by xz";
    case LZMA_BUF_ERROR:
      return "is cut short";
    case LZMA_MEM_ERROR:
    case LZMA_MEMLIMIT_ERROR:
      return "needs too much memory to unpack";
    default:
      return "is damaged: it cannot be unpacked";
  }
}

class Decoder {
 public:
  explicit Decoder(const std::string& packed) {
    if (lzma_stream_decoder(&stream_, kMostMemory, LZMA_CONCATENATED) != LZMA_OK)
      throw std::runtime_error(reason(LZMA_MEM_ERROR));
    stream_.next_in = reinterpret_cast<const std::uint8_t*>(packed.data());
    stream_.avail_in = packed.size();
  }
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;
  ~Decoder() { lzma_end(&stream_); }

  std::string all() {
    std::string out;
    std::array<char, 1 << 16> part{};
    lzma_ret result = LZMA_OK;
    while (result == LZMA_OK) {
      stream_.next_out = reinterpret_cast<std::uint8_t*>(part.data());
      stream_.avail_out = part.size();
      result = lzma_code(&stream_, LZMA_FINISH);
      out.append(part.data(), part.size() - stream_.avail_out);
      if (out.size() > kMostUnpacked) throw std::runtime_error("holds more than 64 MiB");
    }
    if (result != LZMA_STREAM_END) throw std::runtime_error(reason(result));
    return out;
  }

 private:
  lzma_stream stream_ = LZMA_STREAM_INIT;
};

}  // namespace

std::string read_xz(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot be read");
  const std::string packed{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (file.bad()) throw std::runtime_error("cannot be read");
  return Decoder(packed).all();
}

}  // namespace skylight::service::reproduce
