#!/usr/bin/env bash
# Renders the gallery's pictures into this folder: ./make.sh [PRESET...]; all of them unless some are named.
#
# CUTAWAY  the program (default: cutaway)
# VOLUMES  a folder with cranium.mhd, mni_icbm152_t1.nii.gz, and what volumes.py makes (default: volumes)
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
cutaway=${CUTAWAY:-cutaway}
volumes=${VOLUMES:-$here/volumes}
wanted=" $* "

# picture PRESET VOLUME OPTION...: the command that README.md shows for a preset.
picture() {
  local preset=$1 volume=$2
  shift 2
  [[ $wanted == "  " || $wanted == *" $preset "* ]] || return 0
  [[ $volume == sample:* ]] || volume=$volumes/$volume
  "$cutaway" render "$volume" --preset "$preset" "$@" \
    --background 0,0,0 --resolution 288,288 --quiet -o "$here/$preset.png"
}

picture CT-AAA chest-contrast.nrrd --elevation 35 --zoom 1.9
picture CT-AAA2 chest-contrast.nrrd --elevation 35 --zoom 1.9
picture CT-Air chest.nrrd --elevation 35 --zoom 1.9
picture CT-Bone cranium.mhd --azimuth 180 --zoom 1.5
picture CT-Bones cranium.mhd --azimuth 180 --zoom 1.5
picture CT-Cardiac heart.nrrd --azimuth 20 --elevation 15 --zoom 1.2
picture CT-Cardiac2 heart.nrrd --azimuth 20 --elevation 15 --zoom 1.2
picture CT-Cardiac3 heart.nrrd --azimuth 20 --elevation 15 --zoom 1.2
picture CT-Chest-Contrast-Enhanced chest-contrast.nrrd --elevation 35 --zoom 1.9
picture CT-Chest-Vessels chest-contrast.nrrd --elevation 35 --zoom 1.9
picture CT-Coronary-Arteries heart.nrrd --azimuth 20 --elevation 15 --zoom 1.2
picture CT-Coronary-Arteries-2 heart.nrrd --azimuth 20 --elevation 15 --zoom 1.2
picture CT-Coronary-Arteries-3 heart.nrrd --azimuth 20 --elevation 15 --zoom 1.2
picture CT-Cropped-Volume-Bone cranium.mhd --azimuth 180 --elevation -60 --zoom 1.3
picture CT-Fat cranium.mhd --azimuth 180 --zoom 1.5
picture CT-Liver-Vasculature chest-contrast.nrrd --elevation -50 --zoom 2
picture CT-Lung chest.nrrd --elevation 35 --zoom 1.9
picture CT-MIP chest-contrast.nrrd --elevation 35 --zoom 1.9
picture CT-Muscle cranium.mhd --azimuth 180 --zoom 1.5
picture CT-Pulmonary-Arteries chest-contrast.nrrd --elevation 35 --zoom 1.9
picture CT-Soft-Tissue cranium.mhd --azimuth 180 --zoom 1.5
picture CT-X-ray cranium.mhd --azimuth 240 --elevation -15 --zoom 1.4
picture DTI-FA-Brain mni_icbm152_t1.nii.gz --zoom 1.4
picture Generic-MIP sample:bonsai --zoom 1.3
picture Generic-Surface sample:bonsai --zoom 1.3
picture Generic-Translucent sample:bonsai --zoom 1.3
picture MR-Angio sample:mr-head --zoom 1.1
picture MR-Default sample:mr-head --zoom 1.1
picture MR-MIP sample:mr-head --zoom 1.1
picture MR-T2-Brain mni_icbm152_t1.nii.gz --zoom 1.4
picture US-Fetal sample:mr-head --zoom 1.1
