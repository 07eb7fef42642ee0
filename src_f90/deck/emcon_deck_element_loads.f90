!> *DLOAD and *DSLOAD: loads on elements, and on surfaces of elements.
module emcon_deck_element_loads
   use emcon_deck_conditions, only : conditions_t, drop_loads, put_load
   use emcon_deck_element_kinds, only : face_names, face_number
   use emcon_deck_fields, only : check_count, data_error, data_open, data_t, get_name, get_real, &
      is_blank, is_label, next_line
   use emcon_deck_loads, only : card_amplitude, get_load, is_new
   use emcon_deck_named, only : get_elements
   use emcon_deck_reader, only : card_t, reader_t
   use emcon_deck_surfaces, only : surface_names
   use emcon_diagnostics, only : label_list, quoted, suggestion
   use emcon_kinds, only : wp
   use emcon_name_index, only : name_index_find
   use emcon_scene, only : scene_t
   use emcon_steps, only : by_element, by_surface, load_centrifugal, load_gravity, &
      load_pressure, load_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: read_dload, read_dsload

   !> Place of a load on the faces of a surface, until these are known.
   integer, parameter :: on_surface = -2

contains

   !> *DLOAD: element or set, P1..P6, pressure; surface, P, pressure; or GRAV, acceleration,
   !> direction; or CENTRIF, square of the angular velocity, point and direction of the axis.
   subroutine read_dload(reader, card, scene, self)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(conditions_t), intent(inout) :: self
      type(data_t) :: data
      type(load_t) :: new
      integer, allocatable :: item(:), face(:)

      if (is_new(reader, card)) call drop_loads(self, by_element)
      new%origin = card%origin
      new%given = by_element
      new%amplitude = card_amplitude(reader, card, scene)
      call data_open(data, card)
      do while (next_line(reader, data))
         call check_count(reader, data, 2, 9, "element, element set or surface, load type, " // &
            "magnitude")
         if (data%ok) call read_load_type(reader, data, scene, new)
         if (data%ok .and. new%place == on_surface) then
            call get_faces(reader, data, scene, item, face)
         else if (data%ok) then
            call refuse_surface(reader, data)
            if (data%ok) call get_loaded(reader, data, scene, new, item)
            if (data%ok) call check_faces(reader, data, scene, item, new%place)
            if (data%ok) face = spread(new%place, 1, size(item))
         end if
         if (data%ok) call put_loads(self, new, item, face)
      end do
   end subroutine read_dload

   !> The elements that field 1 names; without a name what acts on volumes acts on all elements.
   subroutine get_loaded(reader, data, scene, new, item)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(in) :: scene
      type(load_t), intent(in) :: new
      integer, allocatable, intent(out) :: item(:)
      integer :: i

      if (is_blank(data, 1) .and. new%kind /= load_pressure) then
         item = [(i, i = 1, size(scene%element%label))]
      else
         call get_elements(reader, data, 1, scene, item)
      end if
   end subroutine get_loaded

   !> *DSLOAD: surface, P, pressure.
   subroutine read_dsload(reader, card, scene, self)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(conditions_t), intent(inout) :: self
      type(data_t) :: data
      type(load_t) :: new
      integer, allocatable :: item(:), face(:)
      character(len=:), allocatable :: name

      if (is_new(reader, card)) call drop_loads(self, by_surface)
      new%origin = card%origin
      new%given = by_surface
      new%kind = load_pressure
      new%amplitude = card_amplitude(reader, card, scene)
      call data_open(data, card)
      do while (next_line(reader, data))
         call check_count(reader, data, 2, 3, "surface, P, pressure")
         if (data%ok) call get_name(reader, data, 2, "load type", name)
         if (data%ok) call check_surface_type(reader, data, name)
         if (data%ok) call get_load(reader, data, "pressure", new%value)
         if (data%ok) call get_faces(reader, data, scene, item, face)
         if (data%ok) call put_loads(self, new, item, face)
      end do
   end subroutine read_dsload

   subroutine check_surface_type(reader, data, name)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      character(len=*), intent(in) :: name

      select case (name)
      case ("P")
         continue
      case ("PNU", "HP", "TRVEC", "TRVECNU", "TRSHR", "TRSHRNU", "VP", "SP")
         call data_error(reader, data, "load type " // name // " is known but not supported; " // &
            "supported: P")
      case default
         call data_error(reader, data, "unknown load type " // quoted(name) // "; known: P")
      end select
   end subroutine check_surface_type

   !> Let the load act on the face of each element.
   subroutine put_loads(self, new, item, face)
      type(conditions_t), intent(inout) :: self
      type(load_t), intent(inout) :: new
      integer, intent(in) :: item(:)                     !! elements
      integer, intent(in) :: face(:)                     !! (size(item))
      integer :: i

      do i = 1, size(item)
         new%target = item(i)
         new%place = face(i)
         call put_load(self, new)
      end do
   end subroutine put_loads

   !> The faces of the surface that field 1 names.
   subroutine get_faces(reader, data, scene, item, face)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(out) :: item(:)       !! elements
      integer, allocatable, intent(out) :: face(:)
      character(len=:), allocatable :: name
      integer :: k

      allocate(item(0), face(0))
      if (is_label(data, 1)) then
         call data_error(reader, data, "P acts on the faces of a surface; on faces of " // &
            "elements act " // face_names("P", maxval(scene%element%kinds%n_face)) // " of *DLOAD")
         return
      end if
      call get_name(reader, data, 1, "surface", name)
      if (.not. data%ok) return
      k = name_index_find(reader%names%surfaces, name)
      if (k > 0) then
         item = scene%surface(k)%element
         face = scene%surface(k)%face
         if (size(item) == 0 .and. .not. reader%doubt%elements) call data_error(reader, data, &
            "surface " // name // " has no faces of elements, on which a pressure could act")
      else if (reader%doubt%names) then
         data%ok = .false.
      else if (name_index_find(reader%names%element_sets, name) > 0) then
         call data_error(reader, data, "P acts on the faces of a surface, and " // name // &
            " is an element set: name a *SURFACE, or faces by " // &
            face_names("P", maxval(scene%element%kinds%n_face)) // " of *DLOAD")
      else
         call data_error(reader, data, "unknown surface " // quoted(name) // &
            suggestion(name, surface_names(scene%surface)))
      end if
   end subroutine get_faces

   !> A surface has no numbers of faces, and no volume.
   subroutine refuse_surface(reader, data)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      character(len=:), allocatable :: name

      if (is_blank(data, 1) .or. is_label(data, 1)) return
      call get_name(reader, data, 1, "element label or set", name)
      if (.not. data%ok) return
      if (name_index_find(reader%names%element_sets, name) > 0) return
      if (name_index_find(reader%names%surfaces, name) > 0) call data_error(reader, data, name // &
         " is a surface: a pressure on all of its faces is " // name // ", P, pressure")
   end subroutine refuse_surface

   subroutine check_faces(reader, data, scene, item, face)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: item(:)
      integer, intent(in) :: face
      logical :: has_not(size(item))

      has_not = scene%element%kinds(scene%element%kind(item))%n_face < face
      if (any(has_not)) call data_error(reader, data, "element " &
         // label_list(pack(scene%element%label(item), has_not)) // " has no face " &
         // to_text(face))
   end subroutine check_faces

   !> Kind, place, value and direction of a load on elements, of up to `n_face` faces.
   subroutine read_load_type(reader, data, scene, new)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(in) :: scene
      type(load_t), intent(inout) :: new
      character(len=:), allocatable :: name
      integer :: n_face

      n_face = maxval(scene%element%kinds%n_face)
      call get_name(reader, data, 2, "load type", name)
      new%direction = 0.0_wp
      new%point = 0.0_wp
      call get_load(reader, data, "magnitude", new%value)
      if (.not. data%ok) return
      new%place = face_number(name, "P", n_face)
      if (name == "P") new%place = on_surface
      if (new%place /= 0) then
         new%kind = load_pressure
         call check_count(reader, data, 2, 3, "element, element set or surface, load type, " // &
            "pressure")
         return
      end if
      select case (name)
      case ("GRAV")
         new%kind = load_gravity
         call check_count(reader, data, 2, 6, "element or element set, GRAV, g, nx, ny, nz")
         call read_vector(reader, data, 4, "direction", new%direction)
         if (.not. data%ok) then
            return
         else if (any(abs(new%direction(scene%n_dim + 1:)) > 0.0_wp)) then
            call data_error(reader, data, "the model is plane: gravity has no third component")
         end if
         call make_unit(reader, data, "gravity needs a direction: set, GRAV, g, nx, ny", new)
      case ("CENTRIF")
         new%kind = load_centrifugal
         new%place = -1                            ! it holds beside gravity
         call read_vector(reader, data, 4, "point of the axis", new%point)
         call read_vector(reader, data, 7, "direction of the axis", new%direction)
         call make_unit(reader, data, "CENTRIF needs an axis: set, CENTRIF, omega**2, px, py, " &
            // "pz, nx, ny, nz", new)
      case ("CORIO", "BX", "BY", "BZ", "P1NU", "P2NU", "P3NU", "P4NU", "HP1", "NEWTON")
         call data_error(reader, data, "load type " // name // " is known but not supported; " &
            // "supported: P, " // face_names("P", n_face) // ", GRAV, CENTRIF")
      case default
         call tell_unknown(reader, data, name, face_names("P", n_face))
      end select
   end subroutine read_load_type

   !> A load type that does not exist; one in the first field means that the set is left out.
   subroutine tell_unknown(reader, data, name, faces)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      character(len=*), intent(in) :: name, faces
      character(len=:), allocatable :: first, hint

      call get_name(reader, data, 1, "element or element set", first)
      hint = ""
      if (any(first == ["GRAV   ", "CENTRIF"])) hint = "; the first field names elements: " // &
         "leave it empty for all of them, as in ', " // first // ", ...'"
      if (data%ok) call data_error(reader, data, "unknown load type " // quoted(name) &
         // "; known: P, " // faces // ", GRAV, CENTRIF" // hint)
   end subroutine tell_unknown

   !> Three numbers from field `first` on.
   subroutine read_vector(reader, data, first, what, vector)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      integer, intent(in) :: first
      character(len=*), intent(in) :: what
      real(wp), intent(inout) :: vector(3)         !! what is left out stays
      integer :: k

      do k = 1, size(vector)
         call get_real(reader, data, first - 1 + k, what, vector(k))
      end do
   end subroutine read_vector

   !> The direction of a load to length 1.
   subroutine make_unit(reader, data, missing, new)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      character(len=*), intent(in) :: missing      !! what is told where there is none
      type(load_t), intent(inout) :: new
      real(wp) :: length

      if (.not. data%ok) return
      length = norm2(new%direction)
      if (length > 0.0_wp) new%direction = new%direction/length
      if (.not. length > 0.0_wp) call data_error(reader, data, missing)
   end subroutine make_unit

end module emcon_deck_element_loads
