# Everything comes from Debian's packages (deploy/setup installs them); nothing is downloaded here.
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(CGAL REQUIRED)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(CLI11 REQUIRED)
find_package(tomlplusplus REQUIRED)
find_package(Threads REQUIRED)
find_package(Catch2 REQUIRED)
find_package(benchmark QUIET)

# liblcm's own pkg-config file asks for glib's headers, which its users do not need.
find_path(LCM_INCLUDE_DIR lcm/lcm.h REQUIRED)
find_library(LCM_LIBRARY lcm REQUIRED)
find_program(LCM_GEN lcm-gen REQUIRED)
add_library(understory_lcm INTERFACE)
target_include_directories(understory_lcm INTERFACE "${LCM_INCLUDE_DIR}")
target_link_libraries(understory_lcm INTERFACE "${LCM_LIBRARY}")

find_path(SUITESPARSE_INCLUDE_DIR cholmod.h PATH_SUFFIXES suitesparse REQUIRED)
find_library(CHOLMOD_LIBRARY cholmod REQUIRED)
find_library(CCOLAMD_LIBRARY ccolamd REQUIRED)
add_library(understory_cholmod INTERFACE)
target_include_directories(understory_cholmod SYSTEM INTERFACE "${SUITESPARSE_INCLUDE_DIR}")
# gomp: to keep CHOLMOD to one thread.
target_link_libraries(understory_cholmod INTERFACE "${CHOLMOD_LIBRARY}" "${CCOLAMD_LIBRARY}" gomp)

# libzip's own CMake files ask for its command-line tools, which its users do not need.
find_path(ZIP_INCLUDE_DIR zip.h REQUIRED)
find_library(ZIP_LIBRARY zip REQUIRED)
add_library(understory_zip INTERFACE)
target_include_directories(understory_zip INTERFACE "${ZIP_INCLUDE_DIR}")
target_link_libraries(understory_zip INTERFACE "${ZIP_LIBRARY}")

find_path(LZF_INCLUDE_DIR lzf.h PATH_SUFFIXES liblzf REQUIRED)
find_library(LZF_LIBRARY lzf REQUIRED)
add_library(understory_lzf INTERFACE)
target_include_directories(understory_lzf INTERFACE "${LZF_INCLUDE_DIR}")
target_link_libraries(understory_lzf INTERFACE "${LZF_LIBRARY}")

find_path(PCAP_INCLUDE_DIR pcap/pcap.h REQUIRED)
find_library(PCAP_LIBRARY pcap REQUIRED)
add_library(understory_pcap INTERFACE)
target_include_directories(understory_pcap INTERFACE "${PCAP_INCLUDE_DIR}")
target_link_libraries(understory_pcap INTERFACE "${PCAP_LIBRARY}")

find_path(PROJ_INCLUDE_DIR proj.h REQUIRED)
find_library(PROJ_LIBRARY proj REQUIRED)
add_library(understory_proj INTERFACE)
target_include_directories(understory_proj INTERFACE "${PROJ_INCLUDE_DIR}")
target_link_libraries(understory_proj INTERFACE "${PROJ_LIBRARY}")

# With the session extension, as Debian builds it.
find_path(SQLITE_INCLUDE_DIR sqlite3.h REQUIRED)
find_library(SQLITE_LIBRARY sqlite3 REQUIRED)
add_library(understory_sqlite INTERFACE)
target_include_directories(understory_sqlite INTERFACE "${SQLITE_INCLUDE_DIR}")
target_link_libraries(understory_sqlite INTERFACE "${SQLITE_LIBRARY}")

find_path(CRYPTO_INCLUDE_DIR openssl/evp.h REQUIRED)
find_library(CRYPTO_LIBRARY crypto REQUIRED)
add_library(understory_crypto INTERFACE)
target_include_directories(understory_crypto INTERFACE "${CRYPTO_INCLUDE_DIR}")
target_link_libraries(understory_crypto INTERFACE "${CRYPTO_LIBRARY}")

find_path(ZLIB_INCLUDE_DIR zlib.h REQUIRED)
find_library(ZLIB_LIBRARY z REQUIRED)
add_library(understory_zlib INTERFACE)
target_include_directories(understory_zlib INTERFACE "${ZLIB_INCLUDE_DIR}")
target_link_libraries(understory_zlib INTERFACE "${ZLIB_LIBRARY}")

find_path(ZSTD_INCLUDE_DIR zstd.h REQUIRED)
find_library(ZSTD_LIBRARY zstd REQUIRED)
add_library(understory_zstd INTERFACE)
target_include_directories(understory_zstd INTERFACE "${ZSTD_INCLUDE_DIR}")
target_link_libraries(understory_zstd INTERFACE "${ZSTD_LIBRARY}")

find_path(LZ4_INCLUDE_DIR lz4frame.h REQUIRED)
find_library(LZ4_LIBRARY lz4 REQUIRED)
add_library(understory_lz4 INTERFACE)
target_include_directories(understory_lz4 INTERFACE "${LZ4_INCLUDE_DIR}")
target_link_libraries(understory_lz4 INTERFACE "${LZ4_LIBRARY}")

find_path(BZ2_INCLUDE_DIR bzlib.h REQUIRED)
find_library(BZ2_LIBRARY bz2 REQUIRED)
add_library(understory_bz2 INTERFACE)
target_include_directories(understory_bz2 INTERFACE "${BZ2_INCLUDE_DIR}")
target_link_libraries(understory_bz2 INTERFACE "${BZ2_LIBRARY}")

# Headers alone, for common/place_recognition's sources.
find_path(NANOFLANN_INCLUDE_DIR nanoflann.hpp REQUIRED)

install(TARGETS understory_lcm understory_cholmod understory_zip understory_lzf understory_pcap understory_sqlite
        understory_crypto understory_zlib understory_zstd understory_lz4 understory_bz2 understory_proj EXPORT understory)
