// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/render/sensor.hpp"

#include <algorithm>

#include "tools/simrig/world/random.hpp"

namespace world {
namespace {

std::uint64_t pixel_key(std::uint64_t key, int column, int row) {
    return mixed(key ^
                 (static_cast<std::uint64_t>(row) << 32 | static_cast<std::uint64_t>(column)));
}

// Poisson by adding up its probabilities; for means up to some tens.
double poisson(double mean, double uniform) {
    double probability = std::exp(-mean);
    double sum = probability;
    int n = 0;
    while (uniform > sum && n < 200) {
        n++;
        probability *= mean / n;
        sum += probability;
    }
    return n;
}

}  // namespace

double lit_time_us(const Mains &mains, double start_us, double exposure_us) {
    const double rate = 2 * kPi * mains.frequency_hz * 1e-6;
    const double begin = rate * start_us + mains.phase_rad;
    const double end = begin + rate * exposure_us;
    return exposure_us - mains.modulation / rate * (std::sin(end) - std::sin(begin));
}

double electrons_per_lux(const Sensor &sensor, int channel, double lit_us) {
    return sensor.electrons_per_lux_s * sensor.filter_part[static_cast<std::size_t>(channel)] *
           lit_us * 1e-6;
}

PixelReader::PixelReader(const Sensor &sensor, const Gains &gains, std::uint64_t key)
    : sensor_(sensor),
      gains_(gains),
      key_(key),
      dn_per_electron_((1023 - sensor.black_level_dn) / sensor.full_well_e) {}

double PixelReader::collected(double mean_electrons, int array_column, int array_row) const {
    double mean = mean_electrons;
    if (sensor_.prnu > 0) {
        const std::uint64_t own = pixel_key(sensor_.serial * 2 + 1, array_column, array_row);
        mean *= 1 + sensor_.prnu * normal_from_bits(static_cast<std::uint32_t>(own));
    }
    double electrons = mean;
    if (sensor_.photon_noise > 0) {
        const std::uint64_t bits = pixel_key(key_, array_column, array_row);
        const double drawn =
            mean > 40 ? mean + std::sqrt(mean) * normal_from_bits(static_cast<std::uint32_t>(bits))
                      : poisson(mean, unit_interval(bits));
        electrons += sensor_.photon_noise * (drawn - mean);
    }
    return std::clamp(electrons, 0.0, sensor_.full_well_e);
}

std::uint16_t PixelReader::number(double electrons, int binned, int place, int array_column,
                                  int array_row) const {
    double read = electrons;
    if (sensor_.read_noise_e > 0) {
        const std::uint64_t bits = pixel_key(key_ + 1, array_column, array_row);
        read += sensor_.read_noise_e / std::sqrt(static_cast<double>(binned)) *
                normal_from_bits(static_cast<std::uint32_t>(bits));
    }
    if (sensor_.row_noise_e > 0) {
        read += sensor_.row_noise_e *
                normal_from_bits(static_cast<std::uint32_t>(pixel_key(key_ + 2, 0, array_row)));
    }
    const double black = sensor_.black_level_dn;
    const double converted = std::clamp(
        std::floor(black + read * gains_.analog[place] * dn_per_electron_ + 0.5), 0.0, 1023.0);
    const double digital = gains_.digital[place];
    if (digital == 1) {
        return static_cast<std::uint16_t>(converted);
    }
    return static_cast<std::uint16_t>(
        std::clamp(std::floor(black + (converted - black) * digital + 0.5), 0.0, 1023.0));
}

}  // namespace world
