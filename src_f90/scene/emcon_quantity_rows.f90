!> The output quantities. A new one is a row here and a case of the function of `emcon_quantities`
!> that has the quantities of its places.
submodule (emcon_quantity_registry) emcon_quantity_rows
   implicit none

   type(quantity_row_t), parameter :: rows(*) = [ &
      ! displacement [L], velocity [L/T], force of supports [M L/T^2]
      quantity_row_t("U", at_nodes, of_vector, "displacement", card=at_nodes), &
      quantity_row_t("V", at_nodes, of_vector, "velocity", card=at_nodes), &
      quantity_row_t("RF", at_nodes, of_vector, "reaction_force", "", .true., at_nodes), &
      ! of rigid bodies, at their reference nodes: angle, spin [1/T], moment of supports [M L^2/T^2]
      quantity_row_t("UR", at_nodes, of_rotation, "rotation", "", .true., at_nodes, "UR3"), &
      quantity_row_t("VR", at_nodes, of_rotation, "spin", "", .true., at_nodes, "VR3"), &
      quantity_row_t("RM", at_nodes, of_rotation, "reaction_moment", "", .true., at_nodes, "RM3"), &
      ! place where the node is [L]
      quantity_row_t("COORD", at_nodes, of_vector, "position", card=at_nodes), &
      ! Cauchy stress, and that of von Mises [M/(L T^2)]; of elements, as the strain, means
      quantity_row_t("S", at_nodes, 7, "cauchy_stress", "von_mises", card=at_elements), &
      quantity_row_t("S", at_elements, 6, card=at_elements), &
      quantity_row_t("E", at_elements, of_strain, "strain", "", .false., at_elements, "ME"), &
      ! energies [M L^2/T^2], reference volume [L^3]
      quantity_row_t("ENER", at_elements, 1, "strain_energy", card=at_elements), &
      quantity_row_t("ELSE", at_elements, 1, "strain_energy", card=at_elements), &
      quantity_row_t("ELKE", at_elements, 1, "kinetic_energy", card=at_elements), &
      quantity_row_t("EVOL", at_elements, 1, "volume", card=at_elements), &
      ! gap [L]; pressure, and is it active; force; vectors along the surface: traction
      ! against slip, and status; slip, and path; area on which pressure acts [L^2]
      quantity_row_t("CDIS", at_contacts, 1, "contact_gap", "", .true., at_contacts, "CDISP"), &
      quantity_row_t("CSTR", at_contacts, 2, "contact_pressure", "contact_active", .true., &
         at_contacts, "CSTRESS"), &
      quantity_row_t("CF", at_contacts, of_vector, "contact_force", "", .true., at_contacts, &
         "CFORCE"), &
      quantity_row_t("CSHEAR", at_contacts, of_vector, "contact_shear", "contact_status", .true., &
         at_contacts), &
      quantity_row_t("CSLIP", at_contacts, of_vector, "contact_slip", "slip_path", .true., &
         at_contacts), &
      quantity_row_t("CNAREA", at_contacts, 1, "contact_area", "", .true., at_contacts), &
      ! of surfaces: force on them, moment about the origin, about their centre; centre, area
      quantity_row_t("SOF", at_sections, of_vector, card=at_sections), &
      quantity_row_t("SOM", at_sections, of_rotation, card=at_sections), &
      quantity_row_t("SOMC", at_sections, of_rotation, card=at_sections), &
      quantity_row_t("SOCENTER", at_sections, of_vector, card=at_sections), &
      quantity_row_t("SOAREA", at_sections, card=at_sections), &
      ! force on the slave side with its moment, on the master side; slave surface in contact; how
      ! many
      quantity_row_t("CF", at_pairs, of_wrench), &
      quantity_row_t("CF_MASTER", at_pairs, of_wrench), &
      quantity_row_t("CONTACT_LENGTH", at_pairs, of_length), &
      quantity_row_t("CONTACT_AREA", at_pairs, of_area), &
      quantity_row_t("CNUM", at_pairs, card=at_contacts)]

contains

   module procedure n_quantity_row
      n_quantity_row = size(rows)
   end procedure n_quantity_row

   module procedure quantity_row
      row = rows(i)
   end procedure quantity_row

end submodule emcon_quantity_rows
