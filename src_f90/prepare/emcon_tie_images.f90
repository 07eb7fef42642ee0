!> Ties of a cell that repeats itself, or of a sector: the slave is tied to an image of the master.
!>
!> While ties are prepared the image is there, elements and all, where the map of the tie has it;
!> so it is measured as any other tie. Afterwards its nodes are those that they are images of.
!> Source: docs/theory.md, section 10.11.
module emcon_tie_images
   use emcon_couplings, only : tie_rows_t, tie_t
   use emcon_deck_dimension, only : n_plane
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use emcon_sort, only : find_sorted, unique_sorted
   use emcon_surface_nodes, only : surface_nodes
   use emcon_text, only : notes_t
   use emcon_tie_maps, only : tie_map_is_given, tie_map_place
   use emcon_tie_moves, only : ties_move_nodes
   use emcon_ties_plane, only : tie_rows_part
   implicit none
   private
   public :: tie_images_t, tie_images_add, tie_images_settle, tie_images_take

   !> The nodes behind those of the scene, and what they are images of.
   type :: tie_images_t
      integer :: n_node = 0                      !! of the scene without images
      integer, allocatable :: node(:)            !! (images) that each is the image of
      integer, allocatable :: tie(:)             !! (images) by the map of which tie
   end type tie_images_t

   !> Moves of nodes that other ties move in turn settle in as many rounds.
   integer, parameter :: most_rounds = 4
   !> An image that is off its place by less than this part of the largest coordinate is there.
   real(wp), parameter :: rounding = 64.0_wp*epsilon(1.0_wp)

contains

   !> Let the masters of all ties with a map be images.
   subroutine tie_images_add(self, scene)
      type(tie_images_t), intent(out) :: self
      type(scene_t), intent(inout) :: scene
      integer :: t

      self%n_node = size(scene%x, 2)
      allocate(self%node(0), self%tie(0))
      do t = 1, size(scene%tie)
         if (tie_map_is_given(scene%tie(t)%map)) call add_image(self, scene, t)
      end do
   end subroutine tie_images_add

   !> The image of the master of tie `t`: elements that have its faces, and their nodes.
   subroutine add_image(self, scene, t)
      type(tie_images_t), intent(inout) :: self
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: t
      type(surface_t) :: surface
      type(surface_t), allocatable :: surfaces(:)
      integer, allocatable :: element(:), node(:), part(:, :), old(:), new(:, :)
      integer :: k, i, n, n_old

      surface = scene%surface(scene%tie(t)%master)
      allocate(element, source=unique_sorted(surface%element))
      part = scene%element%node(:, element)
      node = unique_sorted(pack(part, part > 0))
      n = size(scene%x, 2)
      call add_nodes(scene, node, t)
      self%node = [self%node, node]
      self%tie = [self%tie, spread(t, 1, size(node))]
      associate (all => scene%element)
         n_old = size(all%label)
         do k = 1, size(element)
            do i = 1, size(part, 1)
               if (part(i, k) > 0) part(i, k) = n + find_sorted(node, part(i, k))
            end do
         end do
         allocate(old, source=[all%node, part])
         new = reshape(old, [size(part, 1), n_old + size(element)])
         call move_alloc(new, all%node)
         all%label = [all%label, all%label(element)]
         all%origin = [all%origin, all%origin(element)]
         all%kind = [all%kind, all%kind(element)]
         all%section = [all%section, all%section(element)]
      end associate
      do k = 1, size(surface%element)
         surface%element(k) = n_old + find_sorted(element, surface%element(k))
      end do
      surface%name = surface%name // " (where it stands for the slave)"
      scene%tie(t)%map%original = scene%tie(t)%master
      scene%tie(t)%master = size(scene%surface) + 1
      allocate(surfaces(size(scene%surface) + 1))
      surfaces(:size(scene%surface)) = scene%surface
      surfaces(size(surfaces)) = surface
      call move_alloc(surfaces, scene%surface)
   end subroutine add_image

   !> Append the images of nodes by the map of tie `t`.
   subroutine add_nodes(scene, node, t)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: node(:), t
      real(wp) :: image(size(scene%x, 1), size(node))
      integer :: i

      do i = 1, size(node)
         image(:, i) = tie_map_place(scene%tie(t)%map, scene%x(:, node(i)))
      end do
      scene%node%label = [scene%node%label, scene%node%label(node)]
      scene%node%origin = [scene%node%origin, scene%node%origin(node)]
      associate (n_dim => size(image, 1), n => size(scene%x, 2) + size(node))
         scene%x = reshape([scene%x, image], [n_dim, n])
         scene%u0 = reshape([scene%u0, 0.0_wp*image], [n_dim, n])
         scene%v0 = reshape([scene%v0, 0.0_wp*image], [n_dim, n])
      end associate
   end subroutine add_nodes

   !> Where other ties have moved nodes of a master, let its image and the slave follow.
   subroutine tie_images_settle(self, scene, notes, error)
      type(tie_images_t), intent(in) :: self
      type(scene_t), intent(inout) :: scene      !! with the images
      type(notes_t), intent(inout) :: notes
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: place(size(scene%x, 1))
      integer :: round, i
      logical :: has_moved

      do round = 1, most_rounds
         has_moved = .false.
         do i = 1, size(self%node)
            place = tie_map_place(scene%tie(self%tie(i))%map, scene%x(:, self%node(i)))
            associate (x => scene%x(:, self%n_node + i))
               if (all(abs(place - x) <= rounding*maxval(abs(scene%x)))) cycle
               x = place
               has_moved = .true.
            end associate
         end do
         if (.not. has_moved) return
         call ties_move_nodes(scene, notes, error)
         if (allocated(error)) return
      end do
   end subroutine tie_images_settle

   !> What `whole`, the scene with images, has found for the ties of `scene`.
   subroutine tie_images_take(self, whole, scene)
      type(tie_images_t), intent(in) :: self
      type(scene_t), intent(in) :: whole
      type(scene_t), intent(inout) :: scene
      integer :: source(0:size(whole%x, 2)), i, t

      source(:self%n_node) = [(i, i = 0, self%n_node)]
      source(self%n_node + 1:) = self%node
      scene%x = whole%x(:, :self%n_node)
      scene%surface = whole%surface(:size(scene%surface))
      do t = 1, size(scene%tie)
         scene%tie(t)%rows = whole%tie(t)%rows
         if (.not. tie_map_is_given(scene%tie(t)%map)) cycle
         associate (rows => scene%tie(t)%rows)
            rows%is_image = rows%node > self%n_node
            rows%node = source(rows%node)
            rows%covered = reshape(source([rows%covered]), shape(rows%covered))
            if (size(scene%x, 1) == n_plane) call tie_rows_part(rows)
         end associate
         call add_axis(scene, scene%tie(t))
         if (scene%tie(t)%map%reference > 0) call add_reference(scene%tie(t))
      end do
   end subroutine tie_images_take

   !> Nodes of both sides are on the axis: each is tied to its own image.
   subroutine add_axis(scene, tie)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(inout) :: tie
      integer, allocatable :: slave(:), master(:)
      integer :: k

      call surface_nodes(scene, scene%surface(tie%slave), slave)
      call surface_nodes(scene, scene%surface(tie%master), master)
      do k = 1, size(slave)
         if (find_sorted(master, slave(k)) == 0) cycle
         if (any(tie%rows%slave == slave(k))) cycle
         call append_row(tie%rows, [slave(k), slave(k)], [.false., .true.], &
            maxval(tie%rows%size)*[1.0_wp, -1.0_wp])
      end do
   end subroutine add_axis

   pure subroutine append_row(rows, node, is_image, weight)
      type(tie_rows_t), intent(inout) :: rows
      integer, intent(in) :: node(:)
      logical, intent(in) :: is_image(:)
      real(wp), intent(in) :: weight(:)          !! (size of node) the first one is int psi

      rows%slave = [rows%slave, node(1)]
      rows%size = [rows%size, weight(1)]
      rows%start = [rows%start, rows%start(size(rows%start)) + size(node)]
      rows%node = [rows%node, node]
      rows%is_image = [rows%is_image, is_image]
      rows%weight = [rows%weight, weight]
   end subroutine append_row

   !> The translation grows by the displacement of the reference node: images go back by it.
   pure subroutine add_reference(tie)
      type(tie_t), intent(inout) :: tie
      type(tie_rows_t) :: rows
      integer :: k

      rows = tie%rows
      rows%slave = [integer ::]
      rows%size = [real(wp) ::]
      rows%start = [0]
      rows%node = [integer ::]
      rows%is_image = [logical ::]
      rows%weight = [real(wp) ::]
      do k = 1, size(tie%rows%slave)
         associate (from => tie%rows%start(k) + 1, to => tie%rows%start(k + 1))
            associate (weight => tie%rows%weight(from:to), is_image => tie%rows%is_image(from:to))
               call append_row(rows, [tie%rows%node(from:to), tie%map%reference], &
                  [is_image, .false.], [weight, -sum(weight, is_image)])
            end associate
         end associate
      end do
      rows%size = tie%rows%size
      tie%rows = rows
   end subroutine add_reference

end module emcon_tie_images
